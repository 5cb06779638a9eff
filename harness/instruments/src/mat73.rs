//! MATLAB files of version 7.3: HDF5 behind a block of 512 bytes, arrays stored with their axes swapped, structs as
//! groups, text as numbers: <https://www.mathworks.com/help/matlab/import_export/mat-file-versions.html>. Tables,
//! timetables and other objects are left out: their layout is not published.

use crate::hdf5::{self, Dialect};
use crate::Format;

pub(crate) const FORMAT: Format = Format {
    name: "MATLAB 7.3",
    is: |head, _| head.starts_with(b"MATLAB 7.3 MAT-file"),
    open: |path| hdf5::open(path, Dialect::Matlab),
};
