use super::*;

struct Sum([f64; WIDTH]);
impl Kernel for Sum {
    type Output = f64;
    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        L::load(&self.0).horizontal_sum()
    }
}

#[test]
fn a_kernel_runs_on_every_level() {
    for level in Level::ALL {
        assert_eq!(dispatch_at(level, Sum([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])), 36.0);
    }
}
