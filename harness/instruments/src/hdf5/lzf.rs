//! The LZF filter, which h5py registers as 32000; `hdf5-reader` leaves it out and takes filters of its users.
//! Layout of the stream: <http://oldhome.schmorp.de/marc/liblzf.html>.

use hdf5_reader::error::{Error, Result};
use hdf5_reader::messages::filter_pipeline::FilterDescription;

pub(super) const ID: u16 = 32000;

/// The bytes of a chunk; its length stands in the filter's third parameter.
pub(super) fn decode(filter: &FilterDescription, data: &[u8], limit: usize) -> Result<Vec<u8>> {
    let length = filter.client_data.get(2).map_or(limit, |n| *n as usize);
    if length > limit {
        return Err(Error::ResourceLimit(format!("an LZF chunk of {length} bytes")));
    }
    expand(data, length).ok_or_else(|| Error::DecompressionError("damaged LZF chunk".into()))
}

fn expand(data: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut out: Vec<u8> = Vec::new();
    let mut rest = data.iter().copied();
    while let Some(control) = rest.next() {
        let control = usize::from(control);
        if control < 32 {
            for _ in 0..=control {
                out.push(rest.next()?);
            }
        } else {
            let mut copied = control >> 5;
            if copied == 7 {
                copied += usize::from(rest.next()?);
            }
            let back = ((control & 0x1f) << 8 | usize::from(rest.next()?)) + 1;
            let from = out.len().checked_sub(back)?;
            for i in from..from + copied + 2 {
                out.push(out[i]);
            }
        }
        if out.len() > length {
            return None;
        }
    }
    (out.len() == length).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::expand;

    #[test]
    fn a_repeated_run_is_expanded_and_damage_is_refused() {
        // two bytes as they are, then 6 bytes from 2 back
        assert_eq!(expand(&[1, b'a', b'b', 4 << 5, 1], 8).unwrap(), b"abababab");
        assert_eq!(expand(&[1, b'a', b'b', 4 << 5, 9], 8), None);
        assert_eq!(expand(&[1, b'a'], 2), None);
        assert_eq!(expand(&[1, b'a', b'b', 4 << 5, 1], 4), None);
    }
}
