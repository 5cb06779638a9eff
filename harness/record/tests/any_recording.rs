//! Recordings of any numbers.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use record::{read_file, LARGEST};

proptest! {
    #![proptest_config(Config { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() })]

    #[test]
    fn what_is_written_in_si_is_read_to_the_last_bit(
        steps in vec(1e-9..1e3, 16..60),
        force in vec(-LARGEST..LARGEST, 60),
        penetration in vec(-1e-3..1e-3, 60),
    ) {
        let time: Vec<f64> = steps.iter().scan(0.0, |t, step| { *t += step; Some(*t) }).collect();
        let rows = (0..time.len()).map(|i| format!("{:e},{:e},{:e}\n", time[i], force[i], penetration[i]));
        let text = format!("time [s],\"a[1,2]\",force [N],penetration [m]\n{}", rows.map(|r| r.replacen(',', ",0,", 1)).collect::<String>());
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        std::fs::write(&path, text).unwrap();
        let read = read_file(&path).unwrap();
        prop_assert_eq!(&read.channels[0].as_ref().unwrap()[..], &force[..time.len()]);
        prop_assert_eq!(&read.channels[2].as_ref().unwrap()[..], &penetration[..time.len()]);
        prop_assert_eq!(read.time, time);
    }

    #[test]
    fn any_text_is_read_or_refused_with_the_files_name(text in "[-0-9a-zN,.\"\\[\\]\n ]{0,400}") {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        std::fs::write(&path, text).unwrap();
        match read_file(&path) {
            Ok(read) => prop_assert!(read.time.windows(2).all(|w| w[1] > w[0])),
            Err(e) => prop_assert!(e.0.iter().all(|e| e.to_string().contains("r.csv") && !e.cure.is_empty()), "{e}"),
        }
    }
}
