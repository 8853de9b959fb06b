//! A host that traps floating-point exceptions: invalid operations, divisions by zero, overflows.

/// Makes a call with the traps on, and checks that they are on after it.
#[cfg(target_arch = "x86_64")]
pub fn trapped<T>(call: impl FnOnce() -> T) -> T {
    const TRAPPING: u32 = 0x1f80 & !(0x80 | 0x200 | 0x400);
    // SAFETY: a word of defined bits.
    let set = |word: u32| unsafe {
        core::arch::asm!("ldmxcsr [{}]", in(reg) &word, options(nostack, readonly));
    };
    let usual = upt::kernels::flush::read_mode() as u32;
    set(TRAPPING);
    let result = call();
    let after = upt::kernels::flush::read_mode() as u32 & !0x3f;
    set(usual);
    assert_eq!(
        after, TRAPPING,
        "a call changed the host's floating-point mode"
    );
    result
}

/// Other processors are left as they are.
#[cfg(not(target_arch = "x86_64"))]
pub fn trapped<T>(call: impl FnOnce() -> T) -> T {
    call()
}
