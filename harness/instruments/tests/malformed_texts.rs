//! Texts, LabVIEW and universal files that were cut anywhere or have bytes changed: an error or what is whole, never a
//! panic, in bounded time.

use std::fs::write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Reads all of a file; the samples of its groups, or its fault's text.
fn read(path: &Path) -> Result<Vec<Vec<Vec<f64>>>, String> {
    let mut source = instruments::open(path).map_err(|e| e.to_string())?;
    let mut all = Vec::new();
    for (i, group) in source.groups().to_vec().iter().enumerate() {
        let mut samples = vec![Vec::new(); group.channels.len()];
        let read = source.read(i, &mut |block| {
            assert_eq!(block.len(), samples.len());
            assert!(block.iter().all(|c| c.len() == block[0].len() && c.len() <= instruments::BLOCK));
            samples.iter_mut().zip(block).for_each(|(all, of)| all.extend_from_slice(of));
            ControlFlow::Continue(())
        });
        read.map_err(|e| e.to_string())?;
        assert_eq!(samples[0].len() as u64, group.samples);
        assert!(
            group.clock.is_none_or(|c| c.step > 0.0 && c.step.is_finite() && c.start.is_finite()),
            "{:?}",
            group.clock
        );
        all.push(samples);
    }
    Ok(all)
}

fn text() -> Vec<u8> {
    let mut text = "Device: DAQ\r\nSample rate;1000 Hz\r\n\r\nTime [s];Kraft [kN];Weg [µm]\r\n".to_string();
    (0..40)
        .for_each(|i| text += &format!("{}.{:03};{}.25;{}\r\n", i / 1000, i % 1000, 10 + i, i * i).replace('.', ","));
    text += "\r\nTime [s];Kraft [kN]\r\n";
    (0..20).for_each(|i| text += &format!("{i},5;\"{i},25\"\r\n"));
    text.into_bytes()
}

fn stamps() -> Vec<u8> {
    let mut text = "# a logger\nStamp\tEvent\tForce (N)\n".to_string();
    (0..40).for_each(|i| {
        text += &format!("2024-02-29 23:59:{:02}.5\t{}\t{i}.5e-3\n", 20 + i, ["", "start"][usize::from(i % 7 == 0)])
    });
    text.into_bytes()
}

fn oscilloscope() -> Vec<u8> {
    let labels = ["Record Length,2500", "Sample Interval,4e-6", "Trigger Point,1250", "Source,CH1", "Vertical Units,V"];
    let line = |i: usize| format!("{},,{}e-6,{}.5,\n", labels.get(i).unwrap_or(&","), i * 4, i % 5);
    (0..40).map(line).collect::<String>().into_bytes()
}

fn utf16() -> Vec<u8> {
    let text = String::from_utf8(text()).unwrap();
    let units = std::iter::once(0xFEFF).chain(text.encode_utf16());
    units.flat_map(u16::to_le_bytes).collect()
}

fn lvm() -> Vec<u8> {
    let mut text =
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\nX_Columns\tNo\n".to_string();
    text += "Operator\tX\n***End_of_Header***\t\n\t\n***Start_Special***\t\nx\n***End_Special***\t\n";
    for part in 0..3 {
        text += &format!("Channels\t2\t\nSamples\t10\t10\nY_Unit_Label\tN\tV\nX_Dimension\tTime\tTime\nX0\t{p}\t{p}\nDelta_X\t0.001\t0.001\n***End_of_Header***\t\t\nX_Value\tF\tU\tComment\n", p = [0.0, 0.01, 5.0][part]);
        (0..10).for_each(|i| text += &format!("\t{i}.5\t-{i}.25\t{}\n", ["", "note"][i % 2]));
        text += "\n";
    }
    text.into_bytes()
}

fn uff() -> Vec<u8> {
    let mut file =
        b"    -1\n   164\n         1SI                           1\n  1.0D+00  1.0D+00  1.0D+00\n  0.0D+00\n    -1\n"
            .to_vec();
    for (binary, even) in [(false, true), (false, false), (true, true), (true, false)] {
        let (n, parts) = (20_usize, if even { 1 } else { 2 });
        let values: Vec<f32> = (0..n * parts).map(|i| i as f32 * 1.5 - 7.0).collect();
        let kind = if binary {
            format!("58b     1     2          11{:12}     0     0           0           0", 4 * n * parts)
        } else {
            "58".into()
        };
        let axis = |code: i32| format!("{code:10}    0    0    0 NONE                 NONE\n");
        let form = format!("{:10}{n:10}{:10}  0.00000E+00  1.00000E-03  0.00000E+00\n", 2, i32::from(even));
        let head = format!(
            "    -1\n    {kind}\nForce\nNONE\nNONE\nNONE\nNONE\n    1         1    1         0 NONE               3   2 NONE               0   0\n{form}{}{}{}{}",
            axis(17), axis(13), axis(0), axis(0)
        );
        file.extend_from_slice(head.as_bytes());
        if binary {
            values.iter().for_each(|v| file.extend_from_slice(&v.to_le_bytes()));
        } else {
            for line in values.chunks(6) {
                line.iter().for_each(|v| file.extend_from_slice(format!("{:13}", format!("{v:.5E}")).as_bytes()));
                file.push(b'\n');
            }
        }
        file.extend_from_slice(b"    -1\n");
    }
    file
}

fn files() -> Vec<(&'static str, Vec<u8>, usize)> {
    vec![
        ("table.csv", text(), 2),
        ("stamps.txt", stamps(), 1),
        ("scope.csv", oscilloscope(), 1),
        ("utf16.csv", utf16(), 2),
        ("run.lvm", lvm(), 2),
        ("functions.uff", uff(), 3),
    ]
}

fn in_folder(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

/// A group of five samples and more that was cut holds the samples of the whole one, but for the last, whose last number
/// may be cut where nothing shows it.
fn check_prefix(cut: &[Vec<f64>], whole: &[Vec<f64>], of: &str) {
    let sure = cut[0].len().saturating_sub(1);
    if sure < 4 {
        return;
    }
    // a universal file has a channel less for each dataset behind the cut
    assert!(cut.len() <= whole.len(), "{of}");
    for (cut, whole) in cut.iter().zip(whole) {
        let same = cut[..sure].iter().zip(whole).all(|(a, b)| a.to_bits() == b.to_bits());
        assert!(same, "{of}: {cut:?} of {whole:?}");
    }
}

#[test]
fn whole_files_are_read() {
    for (name, content, groups) in files() {
        let (_folder, path) = in_folder(name);
        write(&path, &content).unwrap();
        assert_eq!(read(&path).map(|g| g.len()), Ok(groups), "{name}");
    }
}

#[test]
fn a_cut_file_gives_the_samples_before_the_cut_or_a_fault() {
    for (name, content, _) in files() {
        let (_folder, path) = in_folder(name);
        write(&path, &content).unwrap();
        let whole = read(&path).unwrap();
        let mut kept = 0;
        for length in (0..content.len()).step_by(5) {
            write(&path, &content[..length]).unwrap();
            match read(&path) {
                Ok(groups) => {
                    kept += 1;
                    check_prefix(&groups[0], &whole[0], &format!("{name} cut at {length}"));
                    assert!(groups.len() <= whole.len() + 1, "{name} cut at {length}");
                }
                Err(fault) => assert!(fault.contains(name), "{fault}"),
            }
        }
        assert!(kept > content.len() / 20, "{name}: {kept} of {} cuts were read", content.len());
    }
}

#[test]
fn changed_bytes_give_numbers_or_a_fault() {
    let mut seed = 1_u64;
    let mut random = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    for (name, content, _) in files() {
        let (_folder, path) = in_folder(name);
        let begun = Instant::now();
        for _ in 0..600 {
            let mut changed = content.clone();
            for _ in 0..1 + random(4) {
                let at = random(changed.len());
                changed[at] = random(256) as u8;
            }
            write(&path, &changed).unwrap();
            if let Err(fault) = read(&path) {
                assert!(fault.contains(name), "{fault}");
            }
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "{name} took {:?}", begun.elapsed());
    }
}

#[test]
fn hostile_texts_end_soon() {
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("zeros.csv", [b"1,2\n3,4\n".to_vec(), vec![0; 3_000_000], b"5,6\n".to_vec()].concat()),
        ("returns.csv", [b"1,2\n3,4\n".to_vec(), vec![b'\r'; 3_000_000]].concat()),
        ("delimiters.csv", vec![b','; 3_000_000]),
        ("wide.csv", b"1,".repeat(1_000_000)),
        ("words.csv", b"a b c\n".repeat(200_000)),
        ("headers.csv", b"a,b\n1,2\n\n".repeat(9_000)),
        ("quotes.csv", b"\"1\",\"2\n".repeat(100_000)),
        ("marks.unv", b"    -1\n    58\n".repeat(100_000)),
        (
            "binary.unv",
            b"    -1\n    58b     1     2          11  99999999999     0     0           0           0\n".to_vec(),
        ),
        (
            "one.lvm",
            [
                b"LabVIEW Measurement\t\n***End_of_Header***\t\n".to_vec(),
                b"Channels\t1\n***End_of_Header***\nX_Value\tF\n".repeat(20_000),
            ]
            .concat(),
        ),
    ];
    for (name, content) in cases {
        let (_folder, path) = in_folder(name);
        write(&path, &content).unwrap();
        let begun = Instant::now();
        let result = read(&path);
        assert!(begun.elapsed() < Duration::from_secs(20), "{name} took {:?}", begun.elapsed());
        if let Err(fault) = result {
            assert!(fault.contains(name) && fault.len() < 1000, "{fault}");
        }
    }
}

#[test]
fn names_with_commas_shift_no_column_quoted_or_not() {
    let (_folder, path) = in_folder("r.csv");
    let rows: String = (0..40).map(|i| format!("{}.5,{}.5,{}.5\n", i, 10 * i, 2 * i)).collect();
    for head in ["time [s],\"F[1,2]\",force [N]", "time [s],F[1,2],force [N]"] {
        write(&path, format!("{head}\n{rows}")).unwrap();
        let source = instruments::open(&path).unwrap();
        let names: Vec<&str> = source.groups()[0].channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!((names[0], names[2]), ("time", "force"), "{head}: {names:?}");
        assert_eq!(source.groups()[0].channels[2].unit, "N", "{head}");
    }
}

#[test]
fn headers_of_the_blocks_of_a_rheometer_are_no_samples() {
    let mut text = String::from("Project:,glue,,,\r\n,,,,\r\nResult:,Measurement 1,,,\r\n,,,,\r\n");
    // more lines than are looked at together, few lines, and one that begins with samples not taken
    let lengths = [600usize, 40, 30];
    for (n, length) in lengths.iter().enumerate() {
        text += &format!("Interval and data points:,{},{length},,\r\n", n + 1);
        text += "Interval data:,Point No.,Normal Force,Gap,Time\r\n,,,,\r\n,,[N],[mm],[s]\r\n";
        for i in 0..*length {
            if n == 2 && i < 3 {
                text += &format!(",{}  (invalid),,,\r\n", i + 1);
            } else {
                text += &format!(",{},0.{:03},{}.5,{}.25\r\n", i + 1, i % 50, 700 - i, i);
            }
        }
        text += ",,,,\r\n";
    }
    let (_folder, path) = in_folder("rheometer.csv");
    write(&path, text).unwrap();
    let all = read(&path).unwrap();
    let source = instruments::open(&path).unwrap();
    assert_eq!(all.iter().map(|g| g[0].len()).collect::<Vec<_>>(), [600, 40, 27]);
    for (group, samples) in source.groups().iter().zip(&all) {
        let columns: Vec<_> = group.channels.iter().map(|c| (c.name.as_str(), c.unit.as_str())).collect();
        assert_eq!(columns, [("Point No.", ""), ("Normal Force", "N"), ("Gap", "mm"), ("Time", "s")]);
        assert!(samples[1].iter().all(|f| *f < 0.05), "{samples:?}");
    }
}

#[test]
fn a_remark_beside_the_samples_is_of_them() {
    let mut text = String::from("Remark,t [s],F [N]\n");
    for i in 0..60 {
        text += &format!("{},{i}.5,{i}.25\n", if i == 50 || i == 59 { "tapped" } else { "" });
    }
    let (_folder, path) = in_folder("remarks.csv");
    write(&path, text).unwrap();
    let all = read(&path).unwrap();
    assert_eq!((all.len(), all[0][0].len(), all[0][1][50]), (1, 60, 50.25));
}
