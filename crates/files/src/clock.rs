//! A clock that never goes back; in a browser the one that its owner [sets](set).

#[cfg(target_family = "wasm")]
pub use ToldInstant as Instant;
#[cfg(not(target_family = "wasm"))]
pub use std::time::Instant;
pub use told::{ToldInstant, set};

mod told {
    use std::ops::Sub;
    use std::sync::OnceLock;
    use std::time::Duration;

    static NOW: OnceLock<fn() -> f64> = OnceLock::new();

    /// Sets the clock: a function that tells milliseconds. Only the first call counts.
    pub fn set(now: fn() -> f64) {
        NOW.get_or_init(|| now);
    }

    /// A time that the clock told, since its beginning: what of `std::time::Instant` sessions use.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub struct ToldInstant(Duration);

    impl ToldInstant {
        /// The time; zero without a clock.
        pub fn now() -> ToldInstant {
            let milliseconds = NOW.get().map_or(0.0, |now| now());
            ToldInstant(Duration::try_from_secs_f64(1e-3 * milliseconds).unwrap_or_default())
        }

        /// Time since then.
        pub fn elapsed(self) -> Duration {
            ToldInstant::now().duration_since(self)
        }

        /// Time from `earlier` to this one; zero if that is later.
        pub fn duration_since(self, earlier: ToldInstant) -> Duration {
            self.0.saturating_sub(earlier.0)
        }

        /// A time before this one; `None` before the beginning.
        pub fn checked_sub(self, duration: Duration) -> Option<ToldInstant> {
            self.0.checked_sub(duration).map(ToldInstant)
        }
    }

    impl Sub for ToldInstant {
        type Output = Duration;

        fn sub(self, earlier: ToldInstant) -> Duration {
            self.duration_since(earlier)
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn times_are_those_that_the_clock_tells() {
            assert_eq!(ToldInstant::now(), ToldInstant(Duration::ZERO));
            set(|| 1500.0);
            set(|| 0.0);
            let now = ToldInstant::now();
            assert_eq!(now, ToldInstant(Duration::from_millis(1500)));
            let earlier = now.checked_sub(Duration::from_millis(20)).unwrap();
            assert_eq!((earlier.elapsed(), earlier - now), (Duration::from_millis(20), Duration::ZERO));
            assert_eq!(earlier.checked_sub(Duration::from_secs(2)), None);
        }
    }
}
