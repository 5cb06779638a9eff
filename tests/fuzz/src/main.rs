//! One target under libFuzzer: that whose name FUZZ_TARGET holds. Started by `run`.
#![cfg_attr(fuzzing, no_main)]

#[cfg(fuzzing)]
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    static TARGET: std::sync::OnceLock<fn(&[u8])> = std::sync::OnceLock::new();
    let target = TARGET.get_or_init(|| {
        let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
        touchdown_fuzz::target(&name).unwrap_or_else(|| panic!("FUZZ_TARGET is {name:?}: no such target"))
    });
    target(data)
});

#[cfg(not(fuzzing))]
fn main() {
    for (name, _) in touchdown_fuzz::TARGETS {
        println!("{name}");
    }
}
