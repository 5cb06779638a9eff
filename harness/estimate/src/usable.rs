//! A campaign without the recordings that hold no impact.

use crate::condition::Invalid;
use crate::impact::impact;
use record::Campaign;

/// Recordings named in a refusal.
const NAMED: usize = 3;

/// The campaign without the recordings in which no impact is to be seen, or none that stands out of the noise; each is
/// named, with why, in its warnings.
///
/// # Errors
/// Names them where no recording would be left.
pub fn usable(mut c: Campaign) -> Result<Campaign, Invalid> {
    let (kind, mass) = (c.kind, c.moving_mass.unwrap_or(1.0));
    let mut out: Vec<String> = Vec::new();
    c.retain(|r| match impact(kind, r, mass) {
        Ok(_) => true,
        Err(why) => {
            out.push(format!("{}: {why}", r.file));
            false
        }
    });
    if c.recordings.is_empty() {
        let more = out.len().saturating_sub(NAMED);
        let rest = if more > 0 { format!("; and so on, {more} more") } else { String::new() };
        out.truncate(NAMED);
        return Err(Invalid(format!(
            "no recording is left to judge: {}{rest}; check the signs of the channels, and that the impact was recorded",
            out.join("; ")
        )));
    }
    c.warnings.extend(out.into_iter().map(|o| format!("{o}: it was left out.")));
    Ok(c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::recipe::{write_campaign, Recipe};
    use rand::{RngExt, SeedableRng};

    fn campaign() -> Campaign {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        record::load(dir.path(), &mechanisms::terms()).unwrap()
    }

    #[test]
    fn recordings_of_nothing_and_of_noise_are_left_out_and_named() {
        let mut c = campaign();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        // r03 and r04 are the second level
        c.recordings[2].channels.iter_mut().flatten().for_each(|y| y.fill(0.0));
        for y in c.recordings[3].channels.iter_mut().flatten() {
            y.iter_mut().for_each(|v| *v = rng.random::<f64>() - 0.5);
        }
        // slow noise
        for y in c.recordings[5].channels.iter_mut().flatten() {
            let mut last = 0.0;
            y.iter_mut().for_each(|v| {
                last = 0.9 * last + rng.random::<f64>() - 0.5;
                *v = last;
            });
        }
        let levels = c.levels.clone();
        let c = usable(c).unwrap();
        assert_eq!(c.warnings.len(), 3, "{:?}", c.warnings);
        assert_eq!(c.warnings[0], "r03.csv: no impact is to be seen in it: it was left out.");
        assert_eq!(c.warnings[1], "r04.csv: its peak does not stand out of the noise: it was left out.");
        assert!(c.warnings[2].starts_with("r06.csv"));
        assert_eq!((c.recordings.len(), c.levels.len()), (7, 4));
        assert_eq!(c.levels[1], levels[2]);
        assert_eq!(c.recordings.iter().map(|r| r.level).collect::<Vec<_>>(), [0, 0, 1, 2, 2, 3, 3]);
    }

    #[test]
    fn a_sound_campaign_stays_and_one_of_nothing_is_refused() {
        let mut c = usable(campaign()).unwrap();
        assert_eq!((c.recordings.len(), c.warnings.len()), (10, 0));
        c.recordings.iter_mut().for_each(|r| r.channels.iter_mut().flatten().for_each(|y| y.fill(0.0)));
        let Err(Invalid(e)) = usable(c) else { panic!("usable") };
        assert!(e.contains("r01.csv: no impact") && e.contains("r03.csv") && e.contains("7 more"), "{e}");
    }
}
