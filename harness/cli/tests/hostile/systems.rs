//! A system file with one hostile FMU in it.

use crate::fixture::{Behaviour, Ended, Place};

/// What the FMU does in fmi2DoStep at 5 ms ends it there, and the rows before are written.
fn dies(behaviour: Behaviour, options: &[&str], how: &str) -> Ended {
    let e = Place::new().system(behaviour, options);
    e.died("fmi2DoStep", "0.005 s", how);
    assert!(e.said.contains("bad"), "{}", e.said);
    assert_eq!(e.rows.len(), 51, "{}", e.said);
    assert!(e.rows[50].starts_with("5e-3,"), "{}", e.rows[50]);
    e
}

#[test]
fn a_good_one_runs_to_its_end_and_leaves_nothing() {
    let e = Place::new().system(Behaviour::Good, &[]);
    e.is_whole();
    assert!(e.said.is_empty(), "{}", e.said);
}

#[test]
fn one_that_writes_where_nothing_is_ends_with_the_signal_and_its_last_words() {
    let e = dies(Behaviour::Segfaults, &[], "SIGSEGV");
    assert!(e.said.contains("the last words at 0.005 s") && e.log.contains("the last words"), "{} {}", e.said, e.log);
}

#[test]
fn one_that_aborts_as_on_an_uncaught_exception_ends_with_the_signal() {
    dies(Behaviour::Aborts, &[], "SIGABRT");
}

#[test]
fn one_that_divides_by_zero_ends_with_the_signal() {
    dies(Behaviour::DividesByZero, &[], "SIGFPE");
}

#[test]
fn one_that_overflows_the_stack_ends_with_the_signal() {
    dies(Behaviour::OverflowsTheStack, &[], "it was ended by SIG");
}

#[test]
fn one_that_never_ends_is_ended_by_the_limit_of_time() {
    dies(Behaviour::NeverEnds, &["--fmu-seconds", "2"], "no answer for 2 s; give it more with --fmu-seconds");
}

#[test]
fn one_that_exits_with_code_0_is_no_good_end() {
    dies(Behaviour::Exits, &[], "it left with exit code 0");
}

#[test]
fn one_that_exits_in_another_thread_ends_with_its_code() {
    dies(Behaviour::ExitsInAThread, &[], "it left with exit code 7");
}

#[test]
fn one_that_ends_the_thread_it_is_called_on_ends() {
    dies(Behaviour::EndsItsThread, &["--fmu-seconds", "5"], "");
}

#[test]
fn one_that_takes_all_memory_ends_at_its_limit_which_is_reported() {
    dies(Behaviour::TakesAllMemory, &["--fmu-memory", "300"], "it may take 300 MB of memory, more with --fmu-memory");
}

#[test]
fn one_that_logs_what_is_not_there_ends_alone() {
    dies(Behaviour::LogsWhatIsNotThere, &[], "SIGSEGV");
}

#[test]
fn one_that_kills_its_group_kills_itself_alone() {
    dies(Behaviour::KillsItsGroup, &[], "SIGKILL");
}

#[test]
fn one_that_scribbles_over_what_it_shares_with_the_host_ends_alone() {
    let e = Place::new().system(Behaviour::ScribblesOverSharedMemory, &["--fmu-seconds", "2"]);
    e.died("fmi2DoStep", "0.005 s", "");
    assert_eq!(e.rows.len(), 51, "{}", e.said);
}

#[test]
fn one_whose_getter_writes_beyond_what_it_was_given_ends_alone() {
    let e = Place::new().system(Behaviour::WritesBeyondInGet, &[]);
    e.died("fmi2GetReal", "0.00", "it was ended by SIG");
    assert!(e.rows.len() >= 50, "{}", e.said);
}

#[test]
fn one_that_crashes_before_the_first_step_is_named_with_the_function() {
    let e = Place::new().system(Behaviour::SegfaultsInInitialization, &[]);
    e.died("fmi2ExitInitializationMode", "0 s", "SIGSEGV");
}

#[test]
fn one_that_crashes_when_it_is_loaded_is_named_as_that() {
    let e = Place::compiled("CRASHES_WHEN_LOADED").system(Behaviour::Good, &[]);
    assert_eq!(e.code, Some(4), "{}", e.said);
    for part in ["file.toml:2", "hostile.fmu", "bad", "the loading of its binary", "SIGSEGV"] {
        assert!(e.said.contains(part), "no {part:?} in {}", e.said);
    }
}

#[test]
fn one_that_makes_no_instance_is_bad_input() {
    let e = Place::compiled("MAKES_NOTHING").system(Behaviour::Good, &[]);
    assert_eq!(e.code, Some(2), "{}", e.said);
    assert!(e.said.contains("fmi2Instantiate made no instance") && e.said.contains("it logged nothing"), "{}", e.said);
}

#[test]
fn a_crash_after_the_end_touches_no_results_and_is_reported() {
    for (place, behaviour, what) in [
        (Place::new(), Behaviour::SegfaultsInFree, "fmi2FreeInstance"),
        (Place::compiled("CRASHES_WHEN_UNLOADED"), Behaviour::Good, "the unloading of its binary"),
    ] {
        let e = place.system(behaviour, &[]);
        e.is_whole();
        for part in ["hostile.fmu", what, "SIGSEGV", "the results are not touched by it"] {
            assert!(e.said.contains(part), "no {part:?} in {}", e.said);
        }
    }
    let e = Place::new().system(Behaviour::NeverFrees, &["--fmu-seconds", "2"]);
    e.is_whole();
    assert!(e.said.contains("fmi2FreeInstance") && e.said.contains("no answer for 2 s"), "{}", e.said);
}

#[test]
fn what_it_prints_is_no_part_of_the_answer() {
    let e = Place::new().system(Behaviour::Prints, &["--json"]);
    e.is_whole();
    assert!(e.said.contains("printed by the FMU") && !e.answer.contains("printed"), "{} {}", e.said, e.answer);
    serde_json::from_str::<serde_json::Value>(&e.answer).unwrap();
}

#[test]
fn its_rounding_and_traps_are_its_own() {
    let good = Place::new().system(Behaviour::Good, &[]);
    for options in [&[][..], &["--in-process"]] {
        let e = Place::new().system(Behaviour::ChangesRoundingAndTraps, options);
        e.is_whole();
        assert_eq!(e.rows, good.rows, "{options:?}");
    }
}

#[test]
fn files_that_it_closes_are_its_own() {
    Place::new().system(Behaviour::ClosesFiles, &[]).is_whole();
}

#[test]
fn a_process_that_it_starts_ends_with_it() {
    Place::new().system(Behaviour::LeavesAProcess, &[]).is_whole();
}

#[test]
fn a_flood_of_log_lines_is_bounded_and_counted() {
    let e = Place::new().system(Behaviour::FloodsTheLog, &[]);
    e.is_whole();
    assert!(e.log.lines().count() <= 1001 && e.log.contains("99000 earlier lines are left out"), "{}", &e.log[..200]);
    assert!(e.log.contains("line 99999 of many"));
    let e = Place::new().system(Behaviour::LogsALongLine, &[]);
    e.is_whole();
    assert!(e.log.len() < 100_000 && e.log.contains("(50000000 bytes in all)"), "{}", e.log.len());
}

#[test]
fn numbers_that_are_no_status_and_statuses_that_are_errors_are_told_with_the_rows() {
    for (behaviour, word) in [
        (Behaviour::AnswersNonsense, "4294967289, which is no status of FMI 2.0"),
        (Behaviour::Fails, "fmi2Error"),
        (Behaviour::IsFatal, "fmi2Fatal"),
    ] {
        let e = Place::new().system(behaviour, &[]);
        assert_eq!(e.code, Some(2), "{}", e.said);
        assert!(e.said.contains("fmi2DoStep of bad") && e.said.contains(word), "{}", e.said);
        assert_eq!(e.rows.len(), 51, "{}", e.said);
    }
}

#[test]
fn the_log_of_a_run_that_ends_with_an_error_takes_no_place_of_somebodys_file() {
    let p = Place::new();
    std::fs::create_dir(p.path().join("out")).unwrap();
    std::fs::write(p.path().join("out/log.partial.txt"), "mine").unwrap();
    // one that logs before it crashes
    for _ in 0..2 {
        let e = p.run(&Place::text(Behaviour::Segfaults), &[]);
        assert!(
            e.log.starts_with("What the FMUs have logged until the run ended with an error; SHA-256 "),
            "{:.300}",
            e.log
        );
    }
    let kept = std::fs::read_to_string(p.path().join("out/log.partial.kept.txt"));
    assert_eq!(kept.ok().as_deref(), Some("mine"));
    assert!(!p.path().join("out/log.partial.kept-2.txt").exists(), "ours are replaced");
}

#[test]
fn values_that_are_no_numbers_are_written_as_such() {
    let e = Place::new().system(Behaviour::AnswersNan, &[]);
    e.is_whole();
    assert!(e.rows[100].ends_with(",NaN") && !e.rows[10].contains("NaN"), "{}", e.rows[100]);
}

#[test]
fn one_that_allows_one_instance_a_process_gets_a_process_an_instance() {
    let text = "[[fmu]]\nname = \"a\"\nfile = \"hostile.fmu\"\n[[fmu]]\nname = \"b\"\nfile = \"hostile.fmu\"\n\
                [master]\nstop = 0.01\nstep = 1e-4\n";
    Place::new().run(text, &[]).is_whole();
    let one = text.replacen("[[fmu]]\nname = \"b\"\nfile = \"hostile.fmu\"\n", "", 1);
    Place::new().run(&one, &["--in-process"]).is_whole();
}

#[test]
fn one_that_cuts_the_memory_it_shares_with_the_host_cannot() {
    Place::new().system(Behaviour::CutsSharedMemory, &[]).is_whole();
}

#[test]
fn one_that_its_own_child_traces_is_ended_by_the_limit_of_time() {
    dies(Behaviour::IsTracedByItsChild, &["--fmu-seconds", "2"], "no answer for 2 s");
}

#[test]
fn what_it_starts_in_a_group_of_its_own_ends_with_it() {
    // that no process stays is looked at by each run
    Place::new().system(Behaviour::LeavesAProcessOfItsOwnGroup, &[]).is_whole();
    dies(Behaviour::LeavesAProcessOfItsOwnGroupAndCrashes, &[], "SIGABRT");
}

#[test]
fn one_that_locks_the_folder_it_lies_in_leaves_nothing() {
    Place::new().system(Behaviour::LocksItsFolder, &[]).is_whole();
}

#[test]
fn what_steers_a_terminal_stands_in_no_log() {
    let e = Place::new().system(Behaviour::LogsWhatSteersATerminal, &[]);
    assert_eq!(e.code, Some(2), "{}", e.said);
    assert!(e.log.contains("\\u{1b}[2J\\u{7} wiped") && !e.log.contains('\u{1b}'), "{}", e.log);
    assert!(!e.said.contains(['\u{1b}', '\u{7}']), "{}", e.said);
}

#[test]
fn systems_run_into_one_folder_at_once_are_each_whole_or_refused() {
    let place = Place::new();
    let long = Place::text(Behaviour::Good).replace("step = 1e-4", "step = 1e-6");
    let runs: Vec<_> = [1.0, 2.0, 3.0]
        .into_iter()
        .map(|penetration| {
            let name = format!("{penetration}.toml");
            let text = long.replace("[fmu.set]", &format!("[fmu.set]\npenetration = {penetration}"));
            std::fs::write(place.path().join(&name), text).unwrap();
            let piped = std::process::Stdio::piped;
            let mut command = place.command(&["run", &name, "--out", "out"]);
            command.stdout(piped()).stderr(piped()).spawn().unwrap()
        })
        .collect();
    let mut done = 0;
    for run in runs {
        let o = run.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&o.stderr);
        match o.status.code() {
            Some(0) => done += 1,
            Some(2) => assert!(said.contains("wait for its end, or give another --out"), "{said}"),
            code => panic!("{code:?}: {said}"),
        }
    }
    assert!(done > 0);
    let out = place.path().join("out");
    assert!(output::Manifest::read(&out).unwrap().is_whole(&out));
    let rows = std::fs::read_to_string(out.join("results.csv")).unwrap();
    let forces: std::collections::BTreeSet<_> =
        rows.lines().skip(1).filter_map(|l| l.rsplit_once(',')).map(|l| l.1).collect();
    assert!(rows.lines().count() == 10_002 && forces.len() == 1, "{} rows, {forces:?}", rows.lines().count());
    let mut names: Vec<_> = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["manifest.json", "results.csv", "summary.json"]);
}
