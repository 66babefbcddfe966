//! Sine, cosine and the like with the same bits on every processor.
//!
//! The methods of `f64` call the C library, whose variants for different instruction sets differ
//! in last bits, and a last bit can turn the best grasp into another one of equal quality. Here
//! they are computed in Rust without any variant: the `libm` crate without its feature `arch`.
//! Clippy forbids the methods (`clippy.toml`). What IEEE 754 rounds correctly needs no help:
//! arithmetic, square roots, `mul_add` (a true fused multiply-add, in software where the
//! processor has none), rounding to whole numbers and remainders.

pub use libm::{atan2, cos, exp, hypot, pow, sin};

/// Sine and cosine, in this order.
#[inline]
pub fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any change of these bits changes models, and grasps found among equals.
    #[test]
    fn bits_are_those_of_every_other_machine() {
        let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
        let mut add = |value: f64| {
            for byte in value.to_bits().to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for k in -20_000..20_000 {
            let (x, y) = (f64::from(k) * 0.001_37, f64::from(k % 391) / 64.0);
            let (sine, cosine) = sin_cos(x);
            assert_eq!((sine, cosine), (sin(x), cos(x)));
            for value in [sine, cosine, exp(-x * x), hypot(x, y), atan2(x, y)] {
                add(value);
            }
            add(pow(x.abs(), y));
        }
        assert_eq!(hash, 16_941_712_625_300_968_296);
    }

    #[test]
    fn values_are_right() {
        let third = std::f64::consts::FRAC_PI_3;
        assert!((sin(third) - 0.75_f64.sqrt()).abs() < 2e-16);
        assert!((cos(third) - 0.5).abs() < 2e-16);
        assert!((exp(1.0) - std::f64::consts::E).abs() < 5e-16);
        assert_eq!(hypot(3.0, 4.0), 5.0);
        assert_eq!(atan2(1.0, 0.0), std::f64::consts::FRAC_PI_2);
        assert_eq!(pow(2.0, 10.0), 1024.0);
    }
}
