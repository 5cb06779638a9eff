"""WAV as scipy and libsndfile write it, read by touchdown."""
import struct

import numpy as np
import pytest
import soundfile
from scipy.io import wavfile

RATE = 51200
SIGNAL = np.stack([np.sin(np.arange(70001) * 0.01), np.linspace(-1, 1, 70001), np.random.default_rng(1).uniform(-1, 1, 70001)], 1)


def samples(group):
    return np.array(group["samples"], dtype=float).T


@pytest.mark.parametrize("subtype", ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE"])
@pytest.mark.parametrize("form", ["WAV", "WAVEX"])
def test_every_form_is_read_as_libsndfile_reads_it(tmp_path, dump, subtype, form):
    path = tmp_path / "a.wav"
    soundfile.write(path, SIGNAL, RATE, subtype=subtype, format=form)
    [group] = dump(path)["groups"]
    np.testing.assert_array_equal(samples(group), soundfile.read(path, always_2d=True)[0])
    assert group["clock"] == {"start": 0.0, "step": 1 / RATE} and group["length"] == len(SIGNAL)
    assert [c["unit"] for c in group["channels"]] == [""] * 3 and [c["name"] for c in group["channels"]] == ["channel 1", "channel 2", "channel 3"]
    bits = {"PCM_U8": "8", "FLOAT": "32", "DOUBLE": "64"}.get(subtype, subtype[4:])
    assert ["bits per sample", f"{bits} ({'float' if subtype in ('FLOAT', 'DOUBLE') else 'integer'})"] in group["properties"]
    assert ["sampling rate", f"{RATE} Hz"] in group["properties"]


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.int32, np.float32, np.float64])
def test_scipys_files(tmp_path, dump, kind):
    path = tmp_path / "a.wav"
    raw = (SIGNAL[:, 0] * 100 + 100).astype(kind)
    wavfile.write(path, RATE, raw)
    [group] = dump(path)["groups"]
    full = {np.uint8: 128, np.int16: 2**15, np.int32: 2**31}.get(kind, 1)
    np.testing.assert_array_equal(samples(group)[:, 0], (raw.astype(float) - (128 if kind is np.uint8 else 0)) / full)


def chunk(name, body):
    return name + struct.pack("<I", len(body)) + body + b"\0" * (len(body) % 2)


def test_chunks_of_odd_length_lie_before_the_data(tmp_path, dump):
    path = tmp_path / "a.wav"
    body = b"WAVE" + chunk(b"LIST", b"abc") + chunk(b"fmt ", struct.pack("<HHIIHH", 1, 1, 1000, 2000, 2, 16)) + chunk(b"fact", b"\0" * 4) + chunk(b"data", struct.pack("<3h", 1, -2, 3))
    path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    np.testing.assert_array_equal(samples(dump(path)["groups"][0])[:, 0], np.array([1, -2, 3]) / 2**15)


@pytest.mark.parametrize("claimed", [0, 0xFFFFFFFF, 1000])
def test_a_recorder_that_stopped_leaves_its_samples(tmp_path, dump, claimed):
    path = tmp_path / "a.wav"
    body = b"WAVE" + chunk(b"fmt ", struct.pack("<HHIIHH", 1, 2, 1000, 4000, 4, 16)) + b"data" + struct.pack("<I", claimed) + struct.pack("<7h", *range(7))
    path.write_bytes(b"RIFF" + struct.pack("<I", 0) + body)
    answer = dump(path)
    np.testing.assert_array_equal(samples(answer["groups"][0]), np.arange(6).reshape(3, 2) / 2**15)
    assert ["3 samples" in n for n in answer["notes"]] == [True]


def test_what_is_not_read_says_so(tmp_path, dump):
    path = tmp_path / "a.wav"
    soundfile.write(path, SIGNAL, RATE, subtype="PCM_16", format="RF64")
    assert "RF64" in dump(path, error=True)
    soundfile.write(path, SIGNAL, RATE, subtype="ULAW", format="WAV")
    assert "format 7" in dump(path, error=True)
    path.write_bytes(b"RIFF\0\0\0\0WAVE")
    assert "data" in dump(path, error=True)
