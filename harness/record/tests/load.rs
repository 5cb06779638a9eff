//! Campaigns loaded: all errors at once, nearest words, and what is put right with a note.

use record::{load, Campaign, Label, RecordErrors};
use std::path::Path;
use tempfile::TempDir;

const TERMS: [&str; 4] = ["gravity", "guide_friction", "hysteresis_damping", "viscous_damping"];

const HEAD: &str = "format = \"recordings/1\"\n[campaign]\nkind = \"drop-test\"\n[rig]\nmoving_mass = 0.5\n\
                    [simulation]\nterms = [\"gravity\"]\n";

/// A pulse of 1 ms after 2 ms, every 0.1 ms.
fn csv() -> String {
    let rows = (0..60).map(|i| format!("{:e},{}\n", 1e-4 * f64::from(i), if (20..30).contains(&i) { 100 } else { 0 }));
    format!("time [s],force [N]\n{}", rows.collect::<String>())
}

/// Drops r1.csv, r2.csv and so on from heights of 1, 2 and so on cm.
fn listed(n: usize) -> String {
    (1..=n).map(|i| format!("[[recording]]\nfile = \"r{i}.csv\"\ndrop_height = {}\n", 0.01 * i as f64)).collect()
}

fn folder(campaign: &str, files: &[(&str, String)]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("campaign.toml"), campaign).unwrap();
    for (name, text) in files {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

fn of(dir: &Path) -> Result<Campaign, RecordErrors> {
    load(dir, &TERMS)
}

/// The errors as "campaign.toml:3: what; cure".
fn errors(campaign: &str, files: &[(&str, String)]) -> Vec<String> {
    let dir = folder(campaign, files);
    let e = of(dir.path()).unwrap_err();
    let folder = format!("{}/", dir.path().display());
    assert_eq!(e.to_string().lines().count(), e.0.len());
    e.0.iter().map(|e| e.to_string().replace(&folder, "")).collect()
}

#[test]
fn a_sound_campaign_has_no_notes() {
    let dir = folder(&(HEAD.to_string() + &listed(2)), &[("r1.csv", csv()), ("r2.csv", csv())]);
    let c = of(dir.path()).unwrap();
    assert!(c.warnings.is_empty(), "{:?}", c.warnings);
    assert_eq!((c.recordings.len(), c.levels.len(), c.moving_mass), (2, 2, Some(0.5)));
    assert_eq!(c.simulation.terms, ["gravity"]);
    let r = &c.recordings[1];
    assert_eq!((r.level, r.time.len(), r.rows.len(), r.order), (1, 60, 60, 2.0));
}

#[test]
fn amounts_may_be_written_with_their_unit() {
    let text = (HEAD.to_string() + &listed(1)).replace("moving_mass = 0.5", "moving_mass = \"800 g\"");
    let text = text.replace("drop_height = 0.01", "drop_height = \"12,5 mm\"");
    let c = of(folder(&text, &[("r1.csv", csv())]).path()).unwrap();
    assert_eq!((c.moving_mass, c.recordings[0].drop_height), (Some(0.8), Some(0.0125)));
    let e = errors(&text.replace("800 g", "800 N"), &[("r1.csv", csv())]);
    assert!(e[0].contains("moving_mass = \"800 N\"") && e[0].contains("it measures force"), "{e:?}");
}

#[test]
fn decimal_commas_semicolons_and_swapped_columns_get_the_sentence_that_helps() {
    let text = HEAD.to_string() + &listed(1);
    let with = |csv: String| errors(&text, &[("r1.csv", csv)]).join("\n");
    let commas: String = csv().lines().map(|l| l.replace(',', ";").replace('.', ",") + "\n").collect();
    assert!(with(commas).contains("touchdown import"));
    let both: String =
        "time [s],force [N]\n".to_string() + &(0..20).map(|i| format!("0,{i:03},3,5\n")).collect::<String>();
    assert!(with(both).contains("decimal commas"));
    let quoted = "time [s],force [N]\n".to_string() + &(0..20).map(|i| format!("\"0,{i:03}\",3\n")).collect::<String>();
    assert!(with(quoted).contains("decimal point"));
    let swapped = csv().replace("time [s],force [N]", "force [N],time [s]");
    assert!(with(swapped).contains("are the columns time and force swapped?"));
}

#[test]
fn a_simulation_without_terms_holds_what_every_such_one_does_and_the_notes_say_so() {
    // the force once more as a penetration
    let doubled = |l: &str| l.split_once(',').map_or(l.to_string(), |(t, f)| format!("{t},{f},{f}\n"));
    let csv = csv().lines().map(doubled).collect::<String>();
    let csv = csv.replacen("force [N],force [N]", "force [N],penetration [m]", 1);
    for (kind, rig, recording, usual) in [
        ("drop-test", "moving_mass = 0.5\n", "impact_speed = 1\n", &["gravity", "hysteresis_damping"][..]),
        ("indentation", "", "", &[][..]),
    ] {
        let head = format!("format = \"recordings/1\"\n[campaign]\nkind = \"{kind}\"\n[rig]\n{rig}");
        let list = format!("[[recording]]\nfile = \"r1.csv\"\n{recording}");
        let of_terms = |simulation: &str| {
            let dir = folder(&format!("{head}{simulation}{list}"), &[("r1.csv", csv.clone())]);
            of(dir.path()).unwrap()
        };
        for simulation in ["", "[simulation]\nk = 1e6\n"] {
            let c = of_terms(simulation);
            assert_eq!(c.simulation.terms, usual, "{kind}");
            assert_eq!(c.warnings.iter().any(|w| w.contains("lists no terms")), !usual.is_empty(), "{:?}", c.warnings);
        }
        let none = of_terms("[simulation]\nterms = []\n");
        assert!(none.simulation.terms.is_empty() && none.warnings.is_empty(), "{:?}", none.warnings);
    }
}

#[test]
fn all_errors_are_told_at_once_with_file_line_and_cure() {
    let campaign = "format = \"recordings/1\"\ncolour = 3\n[campaign]\nkind = \"droptest\"\nmaterail = \"steel\"\n\
                    [rig]\nmoving_mass = -1\ntravel = \"far\"\n[simulation]\nterms = [\n  \"gravity\",\n  \"grvity\", 3]\n\
                    moving_mass = 0.5\n[[recording]]\nfile = \"r1.csv\"\ndrop_heigth = 0.02\nimpact_speed = 1\n\
                    [[recording]]\norder = 2\n[[recording]]\nfile = \"r1.csv\"\n[[recording]]\nfile = \"gone.csv\"\n";
    let said = errors(campaign, &[("r1.csv", csv().replace("[N]", "[Nn]"))]);
    let wanted = [
        ("campaign.toml:2: key \"colour\" is not known at the top", "known are format, campaign, rig"),
        ("campaign.toml:4: kind \"droptest\" is not known", "did you mean \"drop-test\"?"),
        ("campaign.toml:5: key \"materail\" is not known under [campaign]", "did you mean \"material\"?"),
        ("campaign.toml:7: moving_mass = -1 is out of range", "give moving_mass as a number above 0, in kg"),
        ("campaign.toml:8: travel is of the wrong type", "give travel as a number above 0, in m"),
        ("campaign.toml:12: terms holds what is no text", "write terms = ["),
        ("campaign.toml:12: term \"grvity\" is not known", "did you mean \"gravity\"?"),
        ("campaign.toml:13: key \"moving_mass\" is not known under [simulation]", "it belongs under [rig]"),
        ("campaign.toml:16: key \"drop_heigth\" is not known", "did you mean \"drop_height\"?"),
        ("campaign.toml:18: this [[recording]] names no file", "add file"),
        ("campaign.toml:21: r1.csv is listed twice (first at line 15)", "list every recording once"),
        ("r1.csv:1: unit \"Nn\" does not measure force", "did you mean \"nN\"?"),
        ("gone.csv: cannot be read", "put the recording beside campaign.toml"),
    ];
    for (said, (what, cure)) in said.iter().zip(wanted) {
        assert!(said.starts_with(what) && said.contains(cure), "{said}");
    }
    assert_eq!(said.len(), wanted.len(), "{said:#?}");
}

#[test]
fn of_very_many_faults_the_first_are_told_and_the_others_counted() {
    let listed: String = (0..3000).map(|i| format!("[[recording]]\nfile = \"r{i}.csv\"\n")).collect();
    let said = errors(&(HEAD.to_string() + &listed), &[]);
    assert!(said.len() == 1001 && said[0].contains("r0.csv: neither"), "{}", said[0]);
    assert!(said[1000].contains("faults more are not told; correct those that are"), "{}", said[1000]);
    let twice = (HEAD.to_string() + &"[[recording]]\nfile = \"r1.csv\"\n".repeat(3000), csv());
    assert_eq!(errors(&twice.0, &[("r1.csv", twice.1)]).len(), 1001);
}

#[test]
fn columns_of_the_users_own_are_numbers_or_texts() {
    let with = |columns: &str| HEAD.replace("[rig]", &format!("{columns}\n[rig]")) + &listed(1);
    let given = with("[campaign.columns]\norder = 17\nbatch = \"B7\"\n\"oil temperature\" = -3.5");
    let dir = folder(&given, &[("r1.csv", csv())]);
    let columns = of(dir.path()).unwrap().columns;
    let expected =
        [("batch", Label::Text("B7".into())), ("oil temperature", Label::Number(-3.5)), ("order", Label::Number(17.0))];
    assert_eq!(columns.into_iter().collect::<Vec<_>>(), expected.map(|(n, v)| (n.to_string(), v)));
    for (wrong, what, cure) in [
        ("columns = 3", "columns is no table", "write [campaign.columns]"),
        ("[campaign.columns]\nbatch = [1]", "column \"batch\" is neither number nor text", "give batch as"),
        ("[campaign.columns]\nx = nan", "column \"x\" is neither number nor text", "give x as"),
        ("[campaign.columns]\n\"a/b\" = 1", "\"a/b\" is no name of a column", "call it by letters"),
        ("batch = 3", "key \"batch\" is not known under [campaign]", "under [campaign.columns]"),
    ] {
        let said = errors(&with(wrong), &[("r1.csv", csv())]);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].contains(what) && said[0].contains(cure), "{}", said[0]);
    }
}

#[test]
fn what_is_missing_is_told_with_its_table() {
    let campaign =
        "[campaign]\nkind = \"contactor_opening\"\n[rig]\ntravel = 0.004\n[[recording]]\nfile = \"r1.csv\"\n";
    let said = errors(campaign, &[("r1.csv", csv())]);
    let wanted = [
        "campaign.toml: format is missing; write format = \"recordings/1\"",
        "campaign.toml:3: moving_mass is missing under [rig]; add moving_mass in kg",
        "campaign.toml:3: return_spring_rate is missing under [rig]; add return_spring_rate in N/m",
        "campaign.toml:5: r1.csv: spring_preload is missing; add spring_preload in N",
    ];
    assert_eq!(said, wanted);
    let said = errors("format = \"recordings/1\"\n", &[]);
    assert_eq!(said.len(), 2, "{said:#?}");
    assert!(said[0].contains("kind is missing") && said[1].contains("no [[recording]] is listed"), "{said:#?}");
}

#[test]
fn every_line_that_is_no_toml_is_reported() {
    let said = errors("format = \n[campaign]\nkind = \"drop-test\"\nname = = 3\n", &[]);
    assert!(said.iter().any(|s| s.starts_with("campaign.toml:1:")), "{said:#?}");
    assert!(said.iter().any(|s| s.starts_with("campaign.toml:4:")), "{said:#?}");
}

#[test]
fn tables_written_otherwise_are_reported() {
    let campaign =
        "format = \"recordings/1\"\nrig = 3\n[campaign]\nkind = \"drop-test\"\n[recording]\nfile = \"r1.csv\"\n";
    let said = errors(campaign, &[]);
    assert!(said.iter().any(|s| s.starts_with("campaign.toml:2: rig is no table")), "{said:#?}");
    assert!(said.iter().any(|s| s.starts_with("campaign.toml:5: recording is no list")), "{said:#?}");
}

#[test]
fn a_kind_is_spelt_with_either_hyphen() {
    for kind in ["drop-test", "drop_test"] {
        let campaign = HEAD.replace("drop-test", kind) + &listed(1);
        let dir = folder(&campaign, &[("r1.csv", csv())]);
        assert_eq!(of(dir.path()).unwrap().kind, record::Kind::DropTest);
    }
}

#[test]
fn merged_rows_and_pauses_are_noted_and_keep_a_row_each() {
    let mut lines: Vec<String> = csv().lines().map(str::to_string).collect();
    lines.insert(11, lines[10].replace(",0", ",7"));
    lines.extend((0..20).map(|i| format!("{},0", 3.0 + 1e-4 * f64::from(i))));
    let dir = folder(&(HEAD.to_string() + &listed(1)), &[("r1.csv", lines.join("\n"))]);
    let c = of(dir.path()).unwrap();
    assert_eq!(c.warnings.len(), 2, "{:#?}", c.warnings);
    assert!(c.warnings[0].ends_with("readings: 1 in all, the first at 0.0009 s (line 12)."), "{:?}", c.warnings);
    assert_eq!(c.warnings[1], "r1.csv: a pause of 2.9941 s after 0.0059 s: what lies after it was left out.");
    let r = &c.recordings[0];
    assert_eq!((r.time.len(), r.rows.len()), (60, 81));
    assert_eq!(r.channels[0].as_ref().unwrap()[9], 3.5);
    let own: Vec<f64> = (0..60).map(f64::from).collect();
    let samples: Vec<f64> = r.rows.iter().map(|row| r.place(&row).of(&own)).collect();
    assert_eq!([9, 10, 11, 60, 80].map(|i| samples[i]), [9.0, 9.0, 10.0, 59.0, 59.0]);
    assert_eq!(r.rows.get(80).time, 3.0019);
}

#[test]
fn what_lies_before_a_release_is_left_out_and_an_accelerometer_zeroed_at_rest_put_right() {
    // held for 0.2 s, 0.1 s of fall, and an impact of 20 ms; the accelerometer reads rest g when held
    let text = |rest: f64| {
        let push = |i: i32| match i {
            0..200 => 9.81,
            200..300 => 0.0,
            300..320 => 130.0 * (std::f64::consts::PI * f64::from(i - 300) / 20.0).sin(),
            _ => 0.0,
        };
        let rows = (0..360).map(|i| format!("{:e},{:e}\n", 1e-3 * f64::from(i), 9.81 * (1.0 - rest) - push(i)));
        format!("time [s],acceleration [m/s^2]\n{}", rows.collect::<String>())
    };
    for rest in [1.0, 0.0] {
        let dir = folder(&(HEAD.to_string() + &listed(1)), &[("r1.csv", text(rest))]);
        let c = of(dir.path()).unwrap();
        let said = "r1.csv: the body rests until its release at 0.2 s: what lies before was left out.";
        assert_eq!(c.warnings[0], said);
        assert_eq!(c.warnings.len(), if rest == 1.0 { 1 } else { 2 }, "{:?}", c.warnings);
        let r = &c.recordings[0];
        assert_eq!((r.time[0], r.time.len(), r.rows.len()), (0.2, 160, 360));
        let a = r.channels[1].as_ref().unwrap();
        assert!(a[..100].iter().all(|a| a.abs() < 1e-9) && (a[110] + 130.0).abs() < 1e-9, "{rest}: {a:?}");
    }
    // what begins in the fall stays
    let begins: String =
        text(1.0).lines().enumerate().filter(|(i, _)| *i == 0 || *i > 210).map(|l| format!("{}\n", l.1)).collect();
    let dir = folder(&(HEAD.to_string() + &listed(1)), &[("r1.csv", begins)]);
    let c = of(dir.path()).unwrap();
    assert!(c.warnings.is_empty() && c.recordings[0].time.len() == 150, "{:?}", c.warnings);
}

#[test]
fn a_speed_at_a_first_sample_that_was_left_out_is_noted() {
    let campaign = HEAD.to_string() + "[[recording]]\nfile = \"r1.csv\"\nstart_speed = 1.0\n";
    let early: String = (0..20).map(|i| format!("{},0\n", 1e-4 * f64::from(i) - 5.0)).collect();
    let text = csv().replacen('\n', &format!("\n{early}"), 1);
    let dir = folder(&campaign, &[("r1.csv", text)]);
    let c = of(dir.path()).unwrap();
    assert!(c.warnings[0].ends_with("what lies before it was left out."), "{:?}", c.warnings);
    assert_eq!(c.warnings[1], "r1.csv: start_speed is taken as that at 0 s, the first sample kept.");
    assert_eq!((c.recordings[0].begins(), c.recordings[0].time[0]), (-5.0, 0.0));
}

#[test]
fn a_level_goes_with_its_last_recording() {
    let files = ["r1.csv", "r2.csv", "r3.csv"].map(|f| (f, csv()));
    let dir = folder(&(HEAD.to_string() + &listed(3)), &files);
    let mut c = of(dir.path()).unwrap();
    c.retain(|r| r.file != "r2.csv");
    assert_eq!(c.levels.iter().map(|l| l.0).collect::<Vec<_>>(), [0.01, 0.03]);
    assert_eq!(c.recordings.iter().map(|r| r.level).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn levels_have_the_values_that_their_names_begin_with_where_the_rest_is_the_same() {
    let of = |names: &[&str]| {
        let mut c = record::Campaign::of("x", record::Kind::Indentation, Vec::new());
        c.levels = names.iter().map(|n| (f64::NAN, n.to_string())).collect();
        c.values_of_levels()
    };
    assert_eq!(of(&["5 N threshold", "10 N threshold"]), Some(vec![5.0, 10.0]));
    assert_eq!(of(&["-0.5 mm", "2e", "3 mm"]), None);
    assert_eq!(of(&["soft", "hard"]), None);
    let numbers = record::Campaign::of("x", record::Kind::DropTest, Vec::new());
    assert_eq!(numbers.values_of_levels(), Some(Vec::new()));
}
