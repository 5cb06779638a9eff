//! Everything a rig, a contact and a measuring chain can hold, each neutral by default.

use crate::wear::{Dose, Taken};
use law::Parameters;
use record::Channel;

pub use crate::constants::{GRAVITY, SLIP_SPEED};

/// A low-pass behaviour of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    /// Corner, rad/s; infinite: none.
    pub corner: f64,
    /// 1: one pole; 2: Butterworth; 3: two equal poles; 4: Bessel of fourth order; 5: a resonance of `damping`.
    pub form: u8,
    /// Damping ratio of form 5.
    pub damping: f64,
    /// Second mode of form 5: its frequency over the first's, and its share of what is read at rest; 0: none.
    pub second_ratio: f64,
    pub second_share: f64,
    pub channel: Channel,
}

impl LowPass {
    /// One of form 1 to 4, or a resonance of form 5 damped critically.
    pub fn new(corner: f64, form: u8, channel: Channel) -> LowPass {
        LowPass { corner, form, damping: 1.0, second_ratio: 1.0, second_share: 0.0, channel }
    }
}

/// The whole forward model of one recording, plain SI; `Physics::default()` is a body of one kilogram
/// without any force on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physics {
    pub law: Parameters,
    /// Impact speed at which the law's hysteresis damping is as given, m/s: it goes with 1/impact speed
    /// (Lankarani and Nikravesh 1990, eq. for mu); infinite: the same at every speed. Drop tests only.
    pub damping_speed: f64,
    /// Moving mass, kg.
    pub mass: f64,
    /// Gravity along +x, m/s^2.
    pub gravity: f64,
    /// Coulomb friction of the guide, N.
    pub friction: f64,
    /// Static excess over the Coulomb level (Stribeck 1902), as a ratio of it, and the speed it fades over, m/s.
    pub stribeck_excess: f64,
    pub stribeck_speed: f64,
    /// Viscous friction of the guide, N s/m.
    pub friction_viscous: f64,
    /// Drag, N at 1 m/s, and its power of the speed.
    pub drag: f64,
    pub drag_power: f64,
    /// Drag on the way back over that on the way in: the body flies through its own wake.
    pub drag_back: f64,
    /// Speed about which the boundary layer turns turbulent, m/s (0: never), and the share of the drag left beyond it.
    pub drag_crisis: f64,
    pub drag_beyond: f64,
    /// Squeeze film: c v (g/(gap+g))^n; N s/m, m, 1.
    pub squeeze: f64,
    pub squeeze_gap: f64,
    pub squeeze_power: f64,
    /// Whether the film pushes on the transducer as well: it does where the transducer carries the stop.
    pub squeeze_reads: bool,
    /// Stop on a spring: mass kg (0: rigid), stiffness N/m, damping N s/m; the stiffness grows by 1 + h u^2, h in 1/m^2;
    /// where h is negative it falls by 1/sqrt(1 - 2 h u^2).
    pub base_mass: f64,
    pub base_stiffness: f64,
    pub base_damping: f64,
    pub base_hardening: f64,
    /// Whether the force channel reads that spring: the transducer is what the stop stands on.
    pub base_reads: bool,
    /// Part loose inside the body: mass kg (0: none; taken out of the moving mass), gap m, stiffness N/m, damping N s/m.
    /// A wall behind it, alike in stiffness and damping, is `loose_back` m away; infinite: none.
    pub loose_mass: f64,
    pub loose_gap: f64,
    pub loose_back: f64,
    pub loose_stiffness: f64,
    pub loose_damping: f64,
    /// Way over which that damping comes in, m; 0: at once.
    pub loose_ramp: f64,
    /// Whether the body bears the part's weight although the part flies free inside it.
    pub loose_borne: bool,
    /// Return spring beyond the one the rig declares: preload at the nominal surface N, rate N/m and its growth N/m^3,
    /// against +x.
    pub spring_preload: f64,
    pub spring_rate: f64,
    pub spring_cubic: f64,
    /// Residual magnetism: force N at closed gap and release, gap m over which and time s in which it fades, power of the gap law.
    pub magnet_force: f64,
    pub magnet_gap: f64,
    pub magnet_time: f64,
    /// Tip mass kg before a transducer of stiffness N/m and damping N s/m (0: rigid).
    pub tip_mass: f64,
    pub tip_stiffness: f64,
    pub tip_damping: f64,
    /// Stiffness lost with the recordings taken before: share, recordings it takes (0: linear, negative: logarithmic),
    /// and what of them counts.
    pub softening: f64,
    pub softening_orders: f64,
    pub softening_by: Dose,
    /// Whether damping keeps what stiffness loses.
    pub softening_spares_damping: bool,
    /// Load at which a crack opens, N, and the share of stiffness lost then.
    pub fracture_load: f64,
    pub fracture_drop: f64,
    /// Latent force of position alone, N, knots evenly over 0..span of depth; conservative or against the motion.
    pub latent: [f64; LATENT],
    pub latent_span: f64,
    pub latent_dissipative: bool,
    /// Bump of resistance against the motion: N, centre m, width m.
    pub jam_force: f64,
    pub jam_position: f64,
    pub jam_width: f64,
    /// Periodic force over depth: amplitude N, wave length m, phase rad.
    pub ripple_force: f64,
    pub ripple_length: f64,
    pub ripple_phase: f64,
    /// Measuring chain. Gains: reading over true; the share by which that of the force grows from one recording to the
    /// next.
    pub gain: [f64; 3],
    pub gain_drift: f64,
    /// Curvature of a scale: reading = u (1 + b u / span).
    pub scale_bend: f64,
    pub scale_span: f64,
    pub scale_channel: Channel,
    pub low_pass: Option<LowPass>,
    /// AC coupling of the force channel, 1/s; second-order when `droop_double`.
    pub droop: f64,
    pub droop_double: bool,
    /// Share of the charge that leaks away.
    pub droop_share: f64,
    pub droop_channel: Channel,
    /// Time by which the channel's samples come late, s.
    pub skew: f64,
    pub skew_channel: Channel,
    /// Level beyond which a channel reads no more (N or m/s^2, of magnitude); `clip_soft` saturates as tanh-like.
    pub clip: f64,
    pub clip_soft: bool,
    /// Time for which an overloaded amplifier goes on reading the level, s.
    pub clip_recovery: f64,
    pub clip_channel: Channel,
}

/// Number of knots of the latent force.
pub const LATENT: usize = 8;

impl Default for Physics {
    fn default() -> Self {
        Physics {
            law: Parameters::default(),
            damping_speed: f64::INFINITY,
            mass: 1.0,
            gravity: 0.0,
            friction: 0.0,
            stribeck_excess: 0.0,
            stribeck_speed: 0.05,
            friction_viscous: 0.0,
            drag: 0.0,
            drag_power: 2.0,
            drag_back: 1.0,
            drag_crisis: 0.0,
            drag_beyond: 1.0,
            squeeze: 0.0,
            squeeze_gap: 1.0,
            squeeze_power: 1.0,
            squeeze_reads: true,
            base_mass: 0.0,
            base_stiffness: 0.0,
            base_damping: 0.0,
            base_hardening: 0.0,
            base_reads: false,
            loose_mass: 0.0,
            loose_gap: 0.0,
            loose_back: f64::INFINITY,
            loose_stiffness: 0.0,
            loose_damping: 0.0,
            loose_ramp: 0.0,
            loose_borne: false,
            spring_preload: 0.0,
            spring_rate: 0.0,
            spring_cubic: 0.0,
            magnet_force: 0.0,
            magnet_gap: 1.0,
            magnet_time: f64::INFINITY,
            tip_mass: 0.0,
            tip_stiffness: 0.0,
            tip_damping: 0.0,
            softening: 0.0,
            softening_orders: 1.0,
            softening_by: Dose::Recordings,
            softening_spares_damping: false,
            fracture_load: f64::INFINITY,
            fracture_drop: 0.0,
            latent: [0.0; LATENT],
            latent_span: 1.0,
            latent_dissipative: false,
            jam_force: 0.0,
            jam_position: 0.0,
            jam_width: 1.0,
            ripple_force: 0.0,
            ripple_length: 1.0,
            ripple_phase: 0.0,
            gain: [1.0; 3],
            gain_drift: 0.0,
            scale_bend: 0.0,
            scale_span: 1.0,
            scale_channel: Channel::Penetration,
            low_pass: None,
            droop: 0.0,
            droop_double: false,
            droop_share: 1.0,
            droop_channel: Channel::Force,
            skew: 0.0,
            skew_channel: Channel::Force,
            clip: f64::INFINITY,
            clip_soft: false,
            clip_recovery: 0.0,
            clip_channel: Channel::Force,
        }
    }
}

impl Physics {
    /// The factor on all stiffness of a contact that had taken so much before.
    pub fn softening_factor(&self, taken: &Taken) -> f64 {
        let n = taken.by(self.softening_by);
        let lost = if self.softening_orders > 0.0 {
            1.0 - (-n / self.softening_orders).exp()
        } else if self.softening_orders == 0.0 {
            n / 10.0
        } else {
            (1.0 + n).ln() / 10f64.ln()
        };
        (1.0 - self.softening * lost).max(0.05)
    }

    /// The share of the drag that is left at a speed, m/s: from 1 far below the crisis to `drag_beyond` far above it,
    /// half of the way at it.
    pub fn past_crisis(&self, v: f64) -> f64 {
        let u = (v / self.drag_crisis).powi(2);
        let u = u * u;
        self.drag_beyond + (1.0 - self.drag_beyond) / (1.0 + u * u)
    }

    /// Whether any position-dependent latent force is there at all.
    pub fn has_latent(&self) -> bool {
        self.jam_force != 0.0 || self.ripple_force != 0.0 || self.latent.iter().any(|a| *a != 0.0)
    }

    /// Position-dependent latent forces against the motion into the stop, N, at depth `x` m and speed `v` m/s.
    #[inline]
    pub fn latent_force(&self, x: f64, v: f64) -> f64 {
        let mut f = 0.0;
        let sign = (v / 0.005).clamp(-1.0, 1.0);
        if self.jam_force != 0.0 {
            let z = (x - self.jam_position) / self.jam_width;
            f += self.jam_force * sign * (-0.5 * z * z).exp();
        }
        if x <= 0.0 {
            return f;
        }
        if self.ripple_force != 0.0 {
            f += self.ripple_force
                * ((std::f64::consts::TAU * x / self.ripple_length + self.ripple_phase).sin()
                    - self.ripple_phase.sin());
        }
        if self.latent_span > 0.0 && self.latent.iter().any(|a| *a != 0.0) {
            let s = (x / self.latent_span * LATENT as f64).min(LATENT as f64);
            let i = s.floor() as usize;
            let at = |i: usize| if i == 0 { 0.0 } else { self.latent[(i - 1).min(LATENT - 1)] };
            let u = s - i as f64;
            let l = at(i) * (1.0 - u) + at(i + 1) * u;
            f += if self.latent_dissipative { l * sign } else { l };
        }
        f
    }
}
