"""Text of a motion file, BVH, ASF or AMC: its encoding, then its words and numbers, within bounds of lines and sizes."""

import codecs
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn, TextIO

from configs.errors import InputError

MAX_BYTES = 256 * 2**20  # of a file; ten minutes of a suit with 59 joints of six channels at 125 Hz
MAX_LINE = 2**20  # characters in a line
MAX_LINES = 5_000_000  # in a file; eleven hours at 120 frames per second
MAX_MAGNITUDE = 1e6  # of an offset or a channel: 1 km in millimetres, 2,777 turns

_COMMENT = re.compile(r"(?:^|\s)(?:#|//|;).*", re.DOTALL)
_NAMING = re.compile(r"\s*(?:ROOT|JOINT|END)", re.IGNORECASE)  # lines in which a name may look like a comment
_PADDING = "\0\x1a\n"  # end of text in DOS, and what a crash leaves of a file whose room was reserved
UTF_8, SHIFT_JIS, LATIN_1 = "utf-8-sig", "cp932", "latin-1"
_BYTE_ORDER_MARKS = {  # those of UTF-32 first: one begins with that of UTF-16
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_SHIFT_JIS_LEAD = re.compile(rb"[\x81-\x9f]")  # begins most kanji and all kana in Shift-JIS, and is no letter in Latin-1
_BLOCK_BYTES = 2**20  # of a file that are decoded at once

_NOT_A_NUMBER = re.compile(r"[+-]?(nan(\(\w*\))?|inf(inity)?|\d\.#\w+)", re.IGNORECASE)  # -nan(ind) and 1.#QNAN are Visual C's


class Reader:
    """Reader of a file's words, which knows the number of the current line.

    Attributes:
        number: Number of the current line.
        words: Words left of it.
        comments: Number of lines with a comment so far, which was left out.
        decimal_comma: Whether a number had a decimal comma so far.
        notices: Lines for the user on what was guessed or mended.
    """

    def __init__(self, path: Path, file: TextIO) -> None:
        """Read ``file`` from where it stands; ``path`` is for messages."""
        self.path, self.file, self.number, self.comments, self.decimal_comma = path, file, 0, 0, False
        self.words: list[str] = []
        self.notices: list[str] = []

    def fail(self, problem: str, line: int | None = None) -> NoReturn:
        """Raise an InputError that names the line: the current one unless another is given."""
        raise InputError(f"{self.path}, line {line or max(self.number, 1)}: {problem}")

    def more(self) -> list[str]:
        """Take the words left of the current line, or those of the next line that has any; none at the end of the file."""
        while not self.words:
            line = self.file.readline(MAX_LINE)
            if not line:
                return []
            self.number += 1
            if len(line) == MAX_LINE or self.number > MAX_LINES:
                self.fail(f"a motion file has at most {MAX_LINES} lines, and fewer than {MAX_LINE} characters in each")
            line = self._without_comment(line.rstrip(_PADDING))
            self.words = line.replace("{", " { ").replace("}", " } ").split()
        words, self.words = self.words, []
        return words

    def rest(self, expected: str) -> list[str]:
        """Take words as ``more`` does, of which there must be some."""
        return self.more() or self.fail(f"the file ends where {expected} should stand")

    def word(self, expected: str) -> str:
        """Take the next word."""
        word, *self.words = self.rest(expected)
        return word

    def name(self, expected: str) -> str:
        """Take the words up to the next '{' or the end of the line, which together are a name; perhaps none."""
        words = self.rest(expected)
        end = words.index("{") if "{" in words else len(words)
        self.words = words[end:]
        return " ".join(words[:end])

    def expect(self, keyword: str) -> None:
        """Take a word that must be this keyword, in upper or lower case."""
        word = self.word(keyword)
        if word.upper() != keyword:
            self.fail(f"{quote(word)} stands where {keyword} should stand")

    def vector(self) -> tuple[float, float, float]:
        """Take three numbers."""
        x, y, z = (self.real(self.word("three numbers after OFFSET")) for _ in range(3))
        return x, y, z

    def real(self, word: str) -> float:
        """Return the number that a word means."""
        try:
            value = float(self._without_commas(word))
        except ValueError:
            self.fail(f"{quote(word)} is not a number")
        if not abs(value) <= MAX_MAGNITUDE:
            self.fail(f"{quote(word)} is out of range; numbers should lie within {MAX_MAGNITUDE:.0e}")
        return value

    def reals(self, words: list[str]) -> list[float]:
        """Return the numbers of a row, of any size, with NaN for what a program writes where it has no number."""
        try:
            return list(map(float, words))
        except ValueError:
            return [self._real_or_nan(word) for word in self._without_commas(" ".join(words)).split()]

    def whole(self, word: str, what: str, most: int) -> int:
        """Return the whole number from 0 to ``most`` that a word means."""
        if not re.fullmatch("[0-9]{1,18}", word) or int(word) > most:
            self.fail(f"{quote(word)} is not a possible {what}; it should be a whole number up to {most}")
        return int(word)

    def _without_comment(self, line: str) -> str:
        """Return a line up to a comment, which begins with a mark at the start of the line or after a blank."""
        if "#" not in line and "//" not in line and ";" not in line:
            return line
        cut = line if _NAMING.match(line) else _COMMENT.sub("", line)
        self.comments += cut != line
        return cut

    def _real_or_nan(self, word: str) -> float:
        try:
            return float(word)
        except ValueError:
            return float("nan") if _NOT_A_NUMBER.fullmatch(word) else self.fail(f"{quote(word)} is not a number")

    def _without_commas(self, text: str) -> str:
        """Return numbers with decimal points and blanks between them.

        A comma before a blank separates; others are decimal unless the text has decimal points or a word with two commas.
        """
        text = re.sub(r",(?=\s|$)", " ", text) if "," in text else text
        if "," not in text:
            return text
        if "." in text or any(word.count(",") > 1 for word in text.split()):
            return text.replace(",", " ")
        self.decimal_comma = True
        return text.replace(",", ".")


def quote(text: str) -> str:
    """Return text from a file in quotes for a message: short, printable, on one line."""
    return ascii(text if len(text) <= 40 else text[:40] + "...")


@contextmanager
def open_text(path: Path, kind: str) -> Iterator[Reader]:
    """Open a file of at most ``MAX_BYTES`` in its encoding.

    Args:
        path: File.
        kind: Name of its format in messages, such as "BVH".

    Yields:
        Reader at its beginning.

    Raises:
        InputError: If there is no such file, it is empty or too long, or it cannot be read.
    """
    a_file = f"{'an' if kind[0] in 'AEIOU' else 'a'} {kind} file"
    try:
        if not path.is_file():
            problem = "not a regular file" if path.exists() else "no such file"
            raise InputError(f"{path}: {problem}; give the path of {a_file}")
        size = path.stat().st_size
        if not 0 < size <= MAX_BYTES:
            raise InputError(f"{path}: {size} bytes long; {a_file} has at least one and at most {MAX_BYTES}")
        # Nothing but a last character that is cut off is left that could be ignored.
        with path.open(encoding=find_encoding(path), errors="ignore") as file:
            yield Reader(path, file)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a readable {kind} file") from error


def find_encoding(path: Path) -> str:
    """Return the encoding of a file's text.

    It is that of a byte order mark or of zero bytes at the start; else UTF-8, Shift-JIS or Latin-1, the first that can be.
    """
    with path.open("rb") as file:
        start = file.read(4)
    wide = {start[1::2]: "utf-16-le", start[::2]: "utf-16-be"}.get(b"\0\0")  # "H" is 48 00 or 00 48
    marked = next((encoding for mark, encoding in _BYTE_ORDER_MARKS.items() if start.startswith(mark)), wide)
    if marked:
        if not _decodes(path, marked):
            raise InputError(f"{path}: begins as {marked.upper()} text, but goes on otherwise; save the file as UTF-8")
        return marked
    return next(encoding for encoding in (UTF_8, SHIFT_JIS, LATIN_1) if _decodes(path, encoding))


def _decodes(path: Path, encoding: str) -> bool:
    """Return whether a file can be text in this encoding; its last character may be cut off."""
    decoder, found = codecs.getincrementaldecoder(encoding)(), encoding != SHIFT_JIS
    with path.open("rb") as file:
        while block := file.read(_BLOCK_BYTES):
            found = found or bool(_SHIFT_JIS_LEAD.search(block))
            try:
                decoder.decode(block)
            except UnicodeDecodeError:
                return False
    return found
