//! Start values and GUID of this library: see [`face::start`].

face::start_block!(crate::variables::Settings, crate::variables::PARAMETERS);
