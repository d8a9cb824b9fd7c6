"""Files that a browser sends: harmless names, and nothing left of what cannot be read."""

from pathlib import Path

import pytest

from configs.errors import InputError
from eval.studio.state.uploads import harmless_name, keep_file, received_file
from tests.datasets.formats.acclaim_files import write_person
from tests.eval.studio.studio_parts import workspace, write_clip


@pytest.mark.parametrize(
    ("sent", "name"),
    [
        ("dance.bvh", "dance.bvh"),
        ("../../etc/dance.BVH", "dance.bvh"),
        ("C:\\temp\\dance.fbx", "dance.fbx"),
        ("a<b>;$(x)\n.bvh", "a_b___(x)_.bvh"),
        ("..bvh", "clip.bvh"),
        ("walk.asf", "walk.asf"),
    ],
)
def test_names_lose_what_means_something(sent: str, name: str) -> None:
    assert harmless_name(sent) == name
    assert "/" not in harmless_name(sent)


@pytest.mark.parametrize("sent", ["", "dance", "dance.exe", "bvh", "x\x1b[31m.sh"])
def test_other_files_are_refused_in_one_line(sent: str) -> None:
    with pytest.raises(InputError) as error:
        harmless_name(sent)
    assert str(error.value).isprintable()


def test_a_file_is_gone_unless_it_is_kept(tmp_path: Path) -> None:
    with received_file("a.bvh", b"one", tmp_path / "kept") as file:
        kept = keep_file(file, tmp_path / "kept")
    assert not file.exists()
    assert kept.read_bytes() == b"one"
    with received_file("a.bvh", b"one", tmp_path / "kept") as file:
        assert keep_file(file, tmp_path / "kept") == kept  # the same again
    with received_file("a.bvh", b"two", tmp_path / "kept") as file:
        assert keep_file(file, tmp_path / "kept").name == "a-2.bvh"
    assert kept.read_bytes() == b"one"


@pytest.mark.parametrize("content", [b"", b"MOTION\n" * 1000, bytes(range(256)) * 100])
def test_a_broken_file_leaves_no_trace(tmp_path: Path, content: bytes) -> None:
    with workspace(None, tmp_path / "kept") as opened:
        with pytest.raises(InputError) as error:
            opened.receive("evil.bvh", content)
        assert opened.files() == []
    assert list(tmp_path.iterdir()) == []
    assert "\n" not in str(error.value)
    assert str(error.value).startswith("evil.bvh")
    assert "/" not in str(error.value)


def test_a_good_file_is_kept_and_opened(tmp_path: Path) -> None:
    content = write_clip(tmp_path).read_bytes()
    with workspace(None, tmp_path / "kept") as opened:
        project = opened.receive("my sway.bvh", content)
        assert project
        assert project.path == (tmp_path / "kept" / "my sway.bvh").resolve()
        assert project.path.read_bytes() == content
        assert opened.files() == [project.path]
        assert opened.receive("my sway.bvh", content) is project  # the same file, with its edits


def test_a_skeleton_is_kept_for_the_motion_that_needs_it(tmp_path: Path) -> None:
    motion = write_person(tmp_path, {})
    (skeleton,) = tmp_path.glob("*.asf")
    with workspace(None, tmp_path / "kept") as opened:
        with pytest.raises(InputError):
            opened.receive(motion.name, motion.read_bytes())  # without its skeleton
        assert opened.receive(skeleton.name, skeleton.read_bytes()) is None
        project = opened.receive(motion.name, motion.read_bytes())
        assert project
        assert len(project.session.recorded) > 1
    assert sorted(file.name for file in (tmp_path / "kept").iterdir()) == sorted([motion.name, skeleton.name])
