//! Compiles the one C file of the host: a logger that takes variadic arguments, which stable Rust cannot define.

fn main() {
    println!("cargo:rerun-if-changed=src/logger.c");
    cc::Build::new().file("src/logger.c").warnings(true).extra_warnings(true).compile("touchdown_host_logger");
}
