//! File formats. A format is one file here with a `sniff` and a `read`, and one row of [`FORMATS`].
