//! The instruction set of the kernel.

use pulp::Arch;
use std::sync::OnceLock;

/// The processor's widest, or the one that the environment variable GRASPMODULI_SIMD names, if
/// the processor has it: `scalar`, `avx2` or `avx512`. Read once. All give the same bits: the
/// variable is there for the check that they do (`make portable`), not for users.
pub(super) fn instructions() -> Arch {
    static CHOSEN: OnceLock<Arch> = OnceLock::new();
    *CHOSEN.get_or_init(|| {
        let named = match std::env::var("GRASPMODULI_SIMD").as_deref() {
            Ok("scalar") => Some(Arch::Scalar),
            #[cfg(target_arch = "x86_64")]
            Ok("avx2") => pulp::x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "x86_64")]
            Ok("avx512") => pulp::x86::V4::try_new().map(Arch::V4),
            _ => None,
        };
        named.unwrap_or_default()
    })
}

/// What it is called, for the check's table.
pub fn instructions_name() -> &'static str {
    match instructions() {
        Arch::Scalar => "scalar",
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "avx2",
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "avx512",
        _ => "other",
    }
}
