//! How the processor rounds and traps is ours: an FMU in this process that leaves it changed changes it for nobody but itself.
//!
//! The calling conventions of both processors have the callee preserve it (System V ABI for x86-64, 3.2.1; Procedure Call
//! Standard for the Arm 64-bit Architecture, 6.1.2); not every FMU does.

/// Control bits of the register as Rust has them: to nearest, no traps, subnormal numbers kept.
#[cfg(target_arch = "x86_64")]
const OURS: u32 = 0x1f80;
/// Bits that only record what has happened.
#[cfg(target_arch = "x86_64")]
const RECORDED: u32 = 0x3f;

/// Puts rounding and traps back to what Rust's arithmetic is defined for. To be called after every call of an FMU.
#[cfg(target_arch = "x86_64")]
#[inline]
pub(super) fn restore() {
    let mut mxcsr = 0u32;
    // SAFETY: stores the register to a local
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut mxcsr, options(nostack, preserves_flags)) };
    if mxcsr & !RECORDED != OURS {
        // SAFETY: loads the register from a constant without a reserved bit
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &OURS, options(nostack, preserves_flags, readonly)) };
    }
}

/// As above.
#[cfg(target_arch = "aarch64")]
#[inline]
pub(super) fn restore() {
    let fpcr: u64;
    // SAFETY: reads the register
    unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) fpcr, options(nomem, nostack, preserves_flags)) };
    if fpcr != 0 {
        // SAFETY: 0 is the register's value in every process that begins
        unsafe { std::arch::asm!("msr fpcr, xzr", options(nomem, nostack, preserves_flags)) };
    }
}

/// Nothing is known of other processors.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
#[inline]
pub(super) fn restore() {}
