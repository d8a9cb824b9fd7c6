"""Reading of joint names: the side and the words of a name, in any order and spelling, without what all joints of a rig share."""

import re
import unicodedata
from collections import Counter
from functools import lru_cache
from typing import NamedTuple


class JointName(NamedTuple):
    """What a joint's name says.

    Attributes:
        side: "l", "r" or None.
        words: Words of the part, such as {"upper", "arm"}; a word that is not known is kept, so that such a name fits no part.
    """

    side: str | None
    words: frozenset[str]


_SIDES = {
    "l": "l left lft lf lt links linke linker linkes gauche izquierda izquierdo izq esquerda esquerdo esq "
    "lewa lewe lewy sinistra sinistro sx 左 왼쪽 왼",
    "r": "r right rgt rt rechts rechte rechter rechtes direita direito dir prawa prawe prawy droite droit "
    "derecha derecho der destra destro dx 右 오른쪽 오른",
}
_SIDE_OF = {word: side for side, words in _SIDES.items() for word in words.split()}
_FRENCH_SIDES = {"g": "l", "d": "r"}  # gauche, droite; read only where no name has another side
# Word of the field -> other spellings, abbreviations and translations of it
_SPELLINGS = {
    "upper": "up uper u",
    "lower": "lo low",
    "fore": "f avant ante avam",
    "arm": "bras brazo braccio 腕 팔 braco",
    "leg": "bein jambe pierna gamba 足 다리 perna been",
    "hand": "main mano 手 손 mao dlon reka",
    "palm": "handflache 手掌",
    "wrist": "handgelenk poignet muneca polso 手首 手腕 손목 pols pulso punho nadgarstek",
    "elbow": "ellbogen ellenbogen coude codo gomito ひじ 肘 手肘 팔꿈치 elleboog cotovelo lokiec",
    "shoulder": "schulter epaule hombro spalla 肩 肩膀 어깨 schouder ombro bark",
    "shldr": "shlder",
    "humerus": "",
    "radius": "",
    "ulna": "",
    "bicep": "biceps",
    "collar": "clavicle clav schlusselbein clavicule clavicula clavicola 鎖骨 锁骨 쇄골 sleutelbeen obojczyk",
    "scapula": "scap",
    "thigh": "oberschenkel cuisse muslo coscia 太もも 大腿 허벅지 bovenbeen coxa udo",
    "femur": "",
    "hip": "hips hufte hanche cadera anca 髋 胯 엉덩이 heup quadril biodro",
    "knee": "knie genou rodilla ginocchio ひざ 膝 膝盖 무릎 joelho kolano",
    "shin": "unterschenkel すね 脛 下腿 小腿 종아리 onderbeen podudzie canela",
    "calf": "mollet pantorrilla kuit lydka",
    "tibia": "",
    "ankle": "knochel cheville tobillo caviglia 足首 脚踝 踝 발목 enkel tornozelo kostka",
    "foot": "fuss pied pie piede 脚 발 voet pe stopa",
    "toe": "toes zehe zehen orteil orteils つま先 足先 脚趾 발가락 teen tenen",
    "ball": "",
    "base": "",
    "head": "kopf tete cabeza testa 頭 头 머리 hoofd cabeca glowa",
    "nose": "nase nez",
    "neck": "hals nacken cou cuello collo 首 颈 脖子 목 nek pescoco szyja",
    "spine": "wirbelsaule colonne columna 上半身 背骨 脊椎 脊柱 척추 ruggengraat wervelkolom coluna kregoslup",
    "hub": "",
    "chest": "thorax ribcage torso brust poitrine pecho 胸 가슴 borst borstkas peito",
    "pelvis": "becken bassin 下半身 骨盤 骨盆 골반 bekken pelve miednica",
    "joint": "",
}
_COMPOUNDS = {
    "bovenarm": "upper arm", "onderarm": "fore arm", "antebraco": "fore arm", "przedramie": "fore arm", "ramie": "upper arm",
    "oberarm": "upper arm", "unterarm": "fore arm", "antebrazo": "fore arm", "avambraccio": "fore arm", "上腕": "upper arm",
    "前腕": "fore arm", "上臂": "upper arm", "大臂": "upper arm", "前臂": "fore arm", "小臂": "fore arm", "下臂": "fore arm",
    "위팔": "upper arm", "아래팔": "fore arm",
}  # fmt: skip
# Words that say what a joint is for, in rigs with several joints for one bone, and not which
_NOISE = ("bone", "mixamorig", "bip", "biped", "jnt", "def", "org", "bend", "stretch", "ex")
_MIDDLE = ("c", "m", "x", "mid", "middle", "center", "centre", "ctr", "センター")  # said of joints without a side
_WORDS: dict[str, tuple[str, ...]] = (
    {spelling: (word,) for word, others in _SPELLINGS.items() for spelling in (word, *others.split())}
    | {name: tuple(words.split()) for name, words in _COMPOUNDS.items()}
    | dict.fromkeys(_NOISE, ())
)
_LOOSE = {"base", "fore", "upper", "lower"}  # words that also name rigs, as in "CC_Base_L_Thigh" and "f_avg_L_Hip"
_LEADING = {"character", "joint"}  # before a name they say nothing
# Words of joints that help or follow a limb, or belong to something else; these are no limb, whatever else they are called
_HELPERS = """
    twist roll ik fk pole target ctrl control end nub tip site helper share socket attach locator muscle
    sleeve cloth skirt hair tail wing weapon prop sword gun breast face facial jaw eye brow lip tongue ear
    finger fingers thumb index middle mid ring pinky little metacarpal inhand 捩 指 親 目 袖"""
HELPER_WORDS = frozenset(_HELPERS.split())
_CJK = "぀-ヿ㐀-鿿가-힣"
_TOKEN = re.compile(rf"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+|[{_CJK}ー]+|[^\W\d_a-zA-Z{_CJK}]+")
SHARED = 0.5  # of the joints, which begin or end with a token that belongs to the rig and not to the joint


def read_joint_names(names: tuple[str, ...]) -> list[JointName]:
    """Return what each joint's name says: "mixamorig:LeftUpLeg", "thigh.L" and "左足" are the left upper leg, thigh and leg.

    Tokens at the beginning or the end of at least half of the names are taken off first.

    Args:
        names: Joint names of one skeleton.
    """
    tokens = [_tokens(name) for name in names]
    for end in (0, -1):
        while shared := _shared(tokens, end):
            tokens = [(words[1:] if end == 0 else words[:-1]) if len(words) > 1 and words[end] == shared else words for words in tokens]
    read = [_read(words, _SIDE_OF) for words in tokens]
    return read if any(name.side for name in read) else [_read(words, _SIDE_OF | _FRENCH_SIDES) for words in tokens]


def _tokens(name: str) -> list[str]:
    """Return a name's words and numbers in lower case, split at changes of case, digits, separators and known words of Japanese."""
    name = unicodedata.normalize("NFKD", name.replace("ß", "ss").replace("ł", "l").replace("Ł", "L").rpartition(":")[2].rpartition("|")[2])
    plain = "".join(letter for letter in name if not "̀" <= letter <= "ͯ")  # accents, but not the marks of kana
    tokens = _TOKEN.findall(unicodedata.normalize("NFC", plain))
    return [part for token in tokens for part in (("l", "f") if token == "LF" else _parts(token.lower()))]  # as in "LFArm", not "lf_arm"


@lru_cache(4096)
def _parts(token: str) -> tuple[str, ...]:
    """Return a token, or the known words that it consists of without a separator: "rthighbend" is "r", "thigh", "bend"."""
    if token in _WORDS or token in _SIDE_OF or token in HELPER_WORDS or token.isdigit():
        return (token,)
    ends: list[tuple[str, ...] | None] = [(), *[None] * len(token)]  # fewest words up to each letter
    foreign = not token.isascii()
    for end in range(1, len(token) + 1):
        for begin in range(max(0, end - 16), end):
            before, word = ends[begin], token[begin:end]
            if before is None or not _is_part(word, token, begin):
                continue
            if ends[end] is None or len(before) + 1 < len(ends[end] or ()):
                ends[end] = (*before, word)
        if foreign and ends[end] is None and ends[end - 1] is not None:
            ends[end] = (*(ends[end - 1] or ()), token[end - 1])
    parts = ends[-1] or (token,)
    return (token,) if "".join(parts) == token and set(parts) <= {"l", "r"} else parts  # "RL" is no side


def _is_part(word: str, token: str, begin: int) -> bool:
    """Return whether a part of a token is a word; single letters are sides at its ends, or abbreviate as in "RUArm"."""
    if len(word) > 1 or not word.isascii():
        return word in _WORDS or word in _SIDE_OF or (not word.isascii() and word in (*HELPER_WORDS, *_MIDDLE))
    if word in ("l", "r"):
        return begin == 0 or begin == len(token) - 1
    return word in ("u", "f") and len(token) == 2


def _shared(tokens: list[list[str]], end: int) -> str | None:
    """Return a token that at least half of the names begin (``end`` 0) or end (-1) with, if it is none of a body's words."""
    counts = Counter(words[end] for words in tokens if len(words) > 1)
    for token, count in counts.most_common(1):
        known = set(_WORDS.get(token, ())) - _LOOSE or token in _SIDE_OF or token in HELPER_WORDS
        if count >= SHARED * len(tokens) and not known:
            return token
    return None


def _read(tokens: list[str], sides: dict[str, str]) -> JointName:
    """Return side and words of a name's tokens; numbers say nothing. ``sides`` holds the side that a token means."""
    tokens = [token for token in tokens if not token.isdigit()]
    while len(tokens) > 1 and (tokens[0] in _LEADING or _WORDS.get(tokens[0]) == ()):
        tokens.pop(0)
    side = next((sides[token] for token in tokens if token in sides), None)
    tokens = [token for token in tokens if token not in sides and (side or token not in _MIDDLE)]
    return JointName(side, frozenset(word for token in tokens for word in _WORDS.get(token, (token,))))
