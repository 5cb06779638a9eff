//! Start values and GUID of this library: see [`face::start`].

face::start_block!(variables::Settings, variables::PARAMETERS);
