"""Writes the small good files that harness/instruments/tests/damaged_files.rs cuts and changes: python write_small_files.py"""
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
import soundfile
from asammdf import MDF, Signal
from nptdms import ChannelObject, RootObject, TdmsWriter

from test_mat73 import matlab, put, text
from test_sheet import START, ods, xls, xlsb, xlsx
from test_uff import dataset
from test_uff import write as write_uff

FILES = Path(__file__).resolve().parents[2] / "harness" / "instruments" / "tests" / "files"


def hdf5(path, libver):
    with h5py.File(path, "w", libver=libver) as f:
        f.attrs["date"] = "2024-03-12"
        f.create_dataset("run/force", data=np.round(np.sin(np.arange(400) / 9), 3), chunks=(64,), compression="gzip", shuffle=True, fletcher32=True).attrs["unit"] = "kN"
        f.create_dataset("run/raw", data=np.arange(400, dtype=">i2"), chunks=(100,), maxshape=(None,))
        f.create_dataset("run/packed", data=np.arange(400) // 50, compression="lzf")
        f["run/table"] = np.arange(40.0).reshape(20, 2)
        f["run"].attrs["sample_rate"] = 1000.0
        f["run/records"] = np.array([(i, i / 2) for i in range(30)], dtype=[("n", "<i4"), ("x", "<f4")])
        f["run/again"] = h5py.SoftLink("/run/force")
        f["comment"] = "soft ground"


TEXT = """Device: DAQ 7
Sample rate;1000 Hz

Time [s];Force [kN]
{}
"""
LVM = """LabVIEW Measurement
Writer_Version	2
Separator	Tab
Decimal_Separator	.
***End_of_Header***

Channels	2
Samples	200	200
X0	0	0
Delta_X	0.001	0.001
***End_of_Header***
X_Value	Force	Acceleration	Comment
{}
"""


def streams(time, force):
    """The formats that are read as streams."""
    with TdmsWriter(FILES / "small.tdms") as f:
        for part in np.split(force, 4):
            f.write_segment([RootObject({"operator": "Ada"}), ChannelObject("Run", "Force", part, {"unit_string": "kN", "wf_increment": 1e-3})])
    with MDF(version="4.10") as f:
        f.append([Signal(force, time, unit="kN", name="Force"), Signal(np.arange(len(time), dtype="<i2"), time, name="Count")])
        f.save(FILES / "small.mf4", overwrite=True, compression=1)
    soundfile.write(FILES / "small.wav", np.stack([force, -force], axis=1), 51200, subtype="PCM_24")
    for compressed in (False, True):
        scipy.io.savemat(FILES / ("packed.mat" if compressed else "matlab5.mat"), {"force": force, "run": {"rate": 1000.0, "who": "Ada", "x": time}}, do_compression=compressed)
    scipy.io.savemat(FILES / "matlab4.mat", {"force": force, "time": time}, format="4")
    (FILES / "small.csv").write_text(TEXT.format("\n".join(f"{t:.3f};{x:.6f}".replace(".", ",") for t, x in zip(time, force))))
    (FILES / "small.lvm").write_text(LVM.format("\n".join(f"{t:.6f}\t{x:.6f}\t{-x:.6f}\t" for t, x in zip(time, force))))
    write_uff(FILES / "small.uff", [dataset(binary=binary, abscissa_spacing=1) for binary in (0, 1)])


def main():
    FILES.mkdir(exist_ok=True)
    streams(np.arange(200) / 1000, np.round(np.sin(np.arange(200) / 9), 6))
    hdf5(FILES / "old.h5", "earliest")
    hdf5(FILES / "new.h5", "latest")
    with matlab(FILES / "matlab73.mat") as f:
        put(f, "force", np.sin(np.arange(200.0))[:, None])
        put(f, "Fs", [[1000.0]])
        text(f, "comment", "soft ground")
        refs = f.create_group("#refs#")
        put(refs, "a", np.arange(20.0)[:, None])
        f["runs"] = np.array([[refs["a"].ref]], dtype=h5py.ref_dtype)
        f["runs"].attrs["MATLAB_class"] = np.bytes_("cell")
    schema = pa.schema([pa.field("stamp", pa.timestamp("ms")), pa.field("F", pa.float64(), metadata={"unit": "kN"}), pa.field("n", pa.int16()), pa.field("lasting", pa.duration("us"))])
    rows = {"stamp": pa.array(range(300), pa.timestamp("ms")), "F": [None if i % 7 == 0 else i / 3 for i in range(300)], "n": pa.array([i % 5 for i in range(300)], pa.int16()), "lasting": pa.array(range(300), pa.duration("us"))}
    for compression in ["snappy", "zstd"]:
        pq.write_table(pa.table(rows, schema=schema), FILES / f"{compression}.parquet", compression=compression, row_group_size=120)
    numbers = [["Drop test 7"], ["Time", "Force"], ["s", "kN"]] + [[i / 10, round(i / 3, 4)] for i in range(30)]
    dated = [["When", "x"]] + [[START, 1], [START, 2]]
    for kind, write in {"xlsx": xlsx, "xls": xls, "ods": ods}.items():
        write(FILES / f"small.{kind}", {"Drop": numbers, "Dated": dated})
    xlsb(FILES / "small.xlsb", {"Drop": numbers})


if __name__ == "__main__":
    main()
