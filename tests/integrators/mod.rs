//! Time integrators against closed forms and high-precision solutions.

mod adaptive;
mod balance;
mod balance_orders;
mod chain;
mod gauss_radau;
mod gravity_over_time;
mod kepler;
mod orders;
mod oscillator;
mod pendulum;
mod prescribed_motion;
mod retries;
mod ring;
mod spurious;
mod stiff;
mod three_bodies;
mod tolerance;
mod walls;
