"""API keys: made once, kept as hashes, and never a service that stands open by mistake."""

import hashlib
from pathlib import Path

import pytest

from duocell.service.cli.main import main
from duocell.service.http.keys import Keyring, KeysUnusable, hash_line, keyring, new_key
from duocell.service.settings import Access


def make(name: str, capsys: pytest.CaptureFixture[str]) -> tuple[str, str]:
    """Hash line and key, as the command line gives them."""
    assert main(["key", "new", name]) == 0
    printed = capsys.readouterr()
    return printed.out, printed.err.splitlines()[-1]


def test_a_key_is_shown_once_and_its_hash_is_what_the_service_needs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line, key = make("press", capsys)
    assert line == f"press:sha256:{hashlib.sha256(key.encode()).hexdigest()}\n"
    assert key not in line
    path = tmp_path / "keys"
    path.write_text(f"# keys of the plant\n\n{line}{make('gateway', capsys)[0]}  ")
    ring = keyring(Access(api_keys_file=path))
    assert ring.owner(key) == "press"
    assert ring.owner(key[:-1]) is None
    assert ring.owner("") is None


def test_keys_are_long_and_never_the_same() -> None:
    keys = {new_key() for _ in range(100)}
    assert len(keys) == 100
    assert all(key.startswith("duocell_") and len(key) >= 8 + 43 for key in keys)


def test_keys_come_from_the_environment_too(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = new_key(), new_key()
    monkeypatch.setenv("DUOCELL_API_KEYS", f"{hash_line('a', first)} {hash_line('b', second)},\n")
    ring = keyring(Access())
    assert (ring.owner(first), ring.owner(second), ring.owner(new_key())) == ("a", "b", None)


def test_every_key_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []

    def compare(one: bytes, other: bytes) -> bool:
        compared.append((one, other))
        return one == other

    monkeypatch.setattr("duocell.service.http.keys.hmac.compare_digest", compare)
    key = new_key()
    lines = " ".join(hash_line(name, key if name == "a" else new_key()) for name in "abc")
    ring = keyring(Access(api_keys=lines))
    assert ring.owner(key) == "a"
    assert ring.owner("\ud800") is None
    assert len(compared) == 6  # all three each time, whichever fits
    assert all(len(one) == len(other) == 32 for one, other in compared)


def test_without_keys_there_is_no_keyring() -> None:
    assert not keyring(Access())
    assert not Keyring()


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("press:sha256:beef", "line 1"),
        ("# nothing yet\n", "holds no key"),
        ("", "holds no key"),
        (f"press:sha256:{'0' * 64}\n{new_key()}\n", "line 2"),
        (f"two words:sha256:{'0' * 64}", "line 1"),
    ],
)
def test_a_file_that_is_no_list_of_keys_stops_the_service(
    tmp_path: Path, text: str, word: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "keys"
    path.write_text(text)
    with pytest.raises(KeysUnusable, match=word) as caught:
        keyring(Access(api_keys_file=path))
    assert "duocell_" not in str(caught.value)  # a key in the wrong place is not shown around
    monkeypatch.setenv("DUOCELL_API_KEYS_FILE", str(path))
    assert main(["serve", "--port", "0"]) == 2
    complaint = capsys.readouterr().err
    assert word in complaint
    assert "duocell_" not in complaint


@pytest.mark.parametrize("content", [None, b"\xff\xfe"])
def test_a_file_that_cannot_be_read_stops_the_service(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "keys"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(KeysUnusable, match="cannot be read"):
        keyring(Access(api_keys_file=path))


def test_a_plain_key_among_the_hashes_is_not_repeated() -> None:
    key = new_key()
    with pytest.raises(KeysUnusable, match="entry 1") as caught:
        keyring(Access(api_keys=key))
    assert key not in str(caught.value)
    assert key not in repr(Access(api_keys=key))


def test_a_name_that_would_break_the_line_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["key", "new", "a:b"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "'a:b'" in printed.err
