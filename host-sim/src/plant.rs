//! The machine behind the step port: five drives, their slides, and how far the tool leaves the path.
//!
//! In: the commanded position of every axis, once per servo tick, in mm or degrees. Out: motor and table
//! position at the same instant, the following error, and - some ticks later, see [`ContourMeter`] - the
//! contour error. Plain `f64`; nothing here goes back into the motion core.
//!
//! Model of one axis (the usual cascade of a machine-tool drive, one lag in place of the velocity loop):
//!
//! ```text
//! v_ref = Kv (command - quantised motor) + ff d(command)/dt       once per tick, held until the next
//! dv/dt = clamp((v_ref - v) / lag, -a_saturation, +a_saturation)  continuous
//! dx/dt = v                                                       motor
//! table = clamp(table, motor - backlash/2, motor + backlash/2)    hysteresis
//! ```
//!
//! With `v_ref` held, both equations have a closed solution over a tick, so no step size enters the result.

mod contour;

use core::fmt;
use std::collections::VecDeque;

use pentaspline::units::AXES;

pub use contour::ContourMeter;

/// Drive and slide of one axis. Lengths are mm for a linear axis and degrees for a rotary one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPlant {
    /// Gain of the position loop, 1/s.
    pub kv_per_s: f64,
    /// Share of the commanded velocity that is fed forward; 0 leaves a following error of v/Kv, 1 none.
    pub feed_forward: f64,
    /// Time constant of the velocity loop, s. 0 is an ideal loop.
    pub velocity_lag_s: f64,
    /// Largest acceleration the drive can give, per s^2.
    pub a_saturation: f64,
    /// Play between motor and table, full width.
    pub backlash: f64,
    /// Increment of the motor encoder the position loop reads. 0 is an ideal encoder.
    pub encoder_resolution: f64,
}

/// Why a plant cannot be built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlantError {
    /// A value is not finite, or has the wrong sign.
    Value {
        /// Index of the axis.
        axis: usize,
        /// Field of [`AxisPlant`].
        field: &'static str,
        /// What it holds.
        value: f64,
    },
    /// The position loop, sampled once per tick, would oscillate with growing amplitude.
    Unstable {
        /// Index of the axis.
        axis: usize,
        /// Its gain, 1/s.
        kv_per_s: f64,
    },
    /// The servo period is not a positive number of seconds.
    Period(f64),
}

impl fmt::Display for PlantError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Value { axis, field, value } => {
                write!(
                    f,
                    "plant of axis {axis}: {field} = {value} is out of range"
                )
            }
            Self::Unstable { axis, kv_per_s } => write!(
                f,
                "plant of axis {axis}: the position loop is unstable at Kv = {kv_per_s} 1/s and this servo rate"
            ),
            Self::Period(dt) => write!(f, "servo period of {dt} s"),
        }
    }
}

impl core::error::Error for PlantError {}

impl AxisPlant {
    /// Checks the values of `axis` for a servo period of `dt_s` seconds.
    ///
    /// # Errors
    /// [`PlantError::Value`] or [`PlantError::Unstable`].
    pub fn validate(&self, axis: usize, dt_s: f64) -> Result<(), PlantError> {
        let fields = [
            ("kv_per_s", self.kv_per_s, f64::MIN_POSITIVE),
            ("feed_forward", self.feed_forward, 0.0),
            ("velocity_lag_s", self.velocity_lag_s, 0.0),
            ("a_saturation", self.a_saturation, f64::MIN_POSITIVE),
            ("backlash", self.backlash, 0.0),
            ("encoder_resolution", self.encoder_resolution, 0.0),
        ];
        for (field, value, least) in fields {
            if !value.is_finite() || value < least {
                return Err(PlantError::Value { axis, field, value });
            }
        }
        if self.sampled_loop_is_stable(dt_s) {
            Ok(())
        } else {
            Err(PlantError::Unstable {
                axis,
                kv_per_s: self.kv_per_s,
            })
        }
    }

    /// Jury's criterion for the loop with its zero-order hold.
    ///
    /// Characteristic polynomial z^2 - (1 + p) z + p + Kv (b1 z + b0) with p = exp(-T/lag),
    /// b1 = T - lag (1 - p), b0 = lag (1 - p) - T p: the textbook discretisation of 1/(s (1 + lag s))
    /// (Astrom and Wittenmark, Computer-Controlled Systems, table of sampled systems).
    fn sampled_loop_is_stable(&self, dt_s: f64) -> bool {
        let (lag, kv) = (self.velocity_lag_s, self.kv_per_s);
        let decay = if lag > 0.0 { (-dt_s / lag).exp() } else { 0.0 };
        let b1 = dt_s - lag * (1.0 - decay);
        let b0 = lag * (1.0 - decay) - dt_s * decay;
        let (a1, a0) = (-(1.0 + decay) + kv * b1, decay + kv * b0);
        a0.abs() < 1.0 && 1.0 - a1 + a0 > 0.0
    }
}

/// State of one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    plant: AxisPlant,
    /// Command of the tick before, for the feed-forward.
    last_command: f64,
    motor: f64,
    velocity: f64,
    table: f64,
}

impl Axis {
    fn at(plant: AxisPlant, position: f64) -> Self {
        Self {
            plant,
            last_command: position,
            motor: position,
            velocity: 0.0,
            table: position,
        }
    }

    fn measured(&self) -> f64 {
        let resolution = self.plant.encoder_resolution;
        if resolution > 0.0 {
            (self.motor / resolution).round() * resolution
        } else {
            self.motor
        }
    }

    /// Moves the axis over one tick of `dt` seconds under `command`.
    fn advance(&mut self, command: f64, dt: f64) {
        let plant = self.plant;
        let v_ref = plant.kv_per_s * (command - self.measured())
            + plant.feed_forward * (command - self.last_command) / dt;
        self.last_command = command;

        // Saturated while the wanted acceleration (v_ref - v)/lag exceeds what the drive can give ...
        let gap = v_ref - self.velocity;
        let knee = plant.a_saturation * plant.velocity_lag_s;
        let saturated = ((gap.abs() - knee) / plant.a_saturation).clamp(0.0, dt);
        let accel = plant.a_saturation.copysign(gap);
        self.motor += (self.velocity + 0.5 * accel * saturated) * saturated;
        self.velocity += accel * saturated;

        // ... then the velocity approaches v_ref exponentially.
        let rest = dt - saturated;
        if rest > 0.0 {
            let gap = v_ref - self.velocity;
            let lag = plant.velocity_lag_s;
            let reached = if lag > 0.0 {
                -(-rest / lag).exp_m1()
            } else {
                1.0
            };
            self.motor += v_ref * rest - gap * lag * reached;
            self.velocity += gap * reached;
        }

        let half = 0.5 * plant.backlash;
        self.table = self.table.clamp(self.motor - half, self.motor + half);
    }
}

/// Where the machine is at the instant of one command. Units: mm or degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlantSample {
    /// Motor positions.
    pub motor: [f64; AXES],
    /// Table positions: motor less what the backlash swallows.
    pub actual: [f64; AXES],
    /// Command minus motor.
    pub following: [f64; AXES],
    /// Contour error in mm of the earliest tick that has none yet: the i-th value ever returned belongs to
    /// the i-th call of [`Plant::step`]. `None` during the first ticks.
    pub contour: Option<f64>,
}

/// All axes.
#[derive(Clone, Debug)]
pub struct Plant {
    axes: [Axis; AXES],
    dt_s: f64,
    linear: [bool; AXES],
    meter: ContourMeter,
    max_following: [f64; AXES],
}

impl Plant {
    /// Machine at rest at `start` (mm or degrees), with a servo period of `dt_s` seconds.
    ///
    /// `linear` tells which axes span the space the contour error is measured in; at most three count.
    ///
    /// # Errors
    /// See [`AxisPlant::validate`]; [`PlantError::Period`] if `dt_s` is no positive number.
    pub fn new(
        axes: &[AxisPlant; AXES],
        linear: [bool; AXES],
        dt_s: f64,
        start: [f64; AXES],
    ) -> Result<Self, PlantError> {
        if !(dt_s.is_finite() && dt_s > 0.0) {
            return Err(PlantError::Period(dt_s));
        }
        let mut settle_s: f64 = 0.0;
        for (a, plant) in axes.iter().enumerate() {
            plant.validate(a, dt_s)?;
            settle_s = settle_s.max(4.0 / plant.kv_per_s + 4.0 * plant.velocity_lag_s);
        }
        // A lag or lead of more than four time constants means a drive in saturation: the error is then
        // reported against the nearest point of the window, which can only be larger.
        let window = (settle_s / dt_s).ceil().clamp(1.0, 4096.0) as usize;
        Ok(Self {
            axes: core::array::from_fn(|a| Axis::at(axes[a], start[a])),
            dt_s,
            linear,
            meter: ContourMeter::new(window),
            max_following: [0.0; AXES],
        })
    }

    /// Takes the command of the next servo tick, returns where the machine is at that instant, and lets
    /// the drives work on it until the next tick.
    pub fn step(&mut self, command: [f64; AXES]) -> PlantSample {
        let mut sample = PlantSample::default();
        for (a, axis) in self.axes.iter_mut().enumerate() {
            sample.motor[a] = axis.motor;
            sample.actual[a] = axis.table;
            sample.following[a] = command[a] - axis.motor;
            self.max_following[a] = self.max_following[a].max(sample.following[a].abs());
            axis.advance(command[a], self.dt_s);
        }
        sample.contour = self
            .meter
            .push(self.linear_part(&command), self.linear_part(&sample.actual));
        sample
    }

    /// Contour errors of the ticks that are still without one, in order.
    pub fn finish(&mut self) -> VecDeque<f64> {
        self.meter.finish()
    }

    /// Largest |command - motor| so far, per axis, mm or degrees.
    #[must_use]
    pub fn max_following(&self) -> [f64; AXES] {
        self.max_following
    }

    /// Largest contour error so far, mm. Complete after [`Plant::finish`].
    #[must_use]
    pub fn max_contour(&self) -> f64 {
        self.meter.max()
    }

    /// The first three linear axes of `all`; missing ones are 0.
    fn linear_part(&self, all: &[f64; AXES]) -> [f64; 3] {
        let mut point = [0.0; 3];
        let linear = (0..AXES).filter(|&a| self.linear[a]);
        for (slot, a) in point.iter_mut().zip(linear) {
            *slot = all[a];
        }
        point
    }
}

#[cfg(test)]
mod tests;
