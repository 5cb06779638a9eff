//! What the law is told: parameters, their forms, their ranges.

/// Parameters of the contact law, plain SI. The default is elastic, every further mechanism neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Stiffness k of F = k x^p, N/m^p, > 0.
    pub stiffness: f64,
    /// Exponent p, 0.5 to 5 (Hertz 1881: 1.5).
    pub exponent: f64,
    /// Hysteresis damping mu_d of mu_d x^(p+o) v, N s/m^(p+o+1), >= 0 (Hunt and Crossley 1975;
    /// Lankarani and Nikravesh 1990).
    pub hysteresis_damping: f64,
    /// Offset o of the damping's power of x from p, -p to 5: 0 Hunt and Crossley 1975; -1 Kuwabara and
    /// Kono 1987 (damping on the tangent stiffness); -(p+1)/2 Tsuji, Tanaka and Ishida 1992 (x^(1/4) at p = 1.5).
    pub damping_exponent_offset: f64,
    /// Speed at which shear thinning has halved the hysteresis damping, m/s, >= 0: mu_d x^(p+o) v/(1 + |v|/v_h)
    /// (Cross 1965); 0: in proportion to v.
    pub hysteresis_thinning_speed: f64,
    /// Kelvin-Voigt damping c, N s/m, >= 0 (Ahn and Ryu 2005, eq. 1).
    pub viscous_damping: f64,
    /// Depth over which the viscous damping ramps in, m, >= 0; 0: from first touch.
    pub viscous_ramp: f64,
    /// Speed at which shear thinning has halved the viscous damping, m/s, >= 0: c/(1 + |v|/v_t) (Cross 1965);
    /// 0: Newtonian.
    pub viscous_thinning_speed: f64,
    /// Penetration y at first yield, m, >= 0.
    pub yield_penetration: f64,
    /// Permanent set per metre of deepest penetration beyond yield, 0 to below 1; 0: neutral
    /// (Lankarani and Nikravesh 1994). With [`PlasticForm::Thornton`] any value above 0 switches yielding on.
    pub plastic_ratio: f64,
    /// Number of a [`PlasticForm`].
    pub plastic_form: i32,
    /// Power n of the unloading curve of [`PlasticForm::PermanentSet`], 0.5 to 5; 0: the exponent p
    /// (Oliver and Pharr 1992 found 1.2 to 1.6).
    pub plastic_unloading_exponent: f64,
    /// 0: the hysteresis damping keeps its power of x while the plastic branch is followed;
    /// 1: it multiplies that branch, F = F_branch (1 + mu_d/k x^o v). The same where nothing yielded.
    pub plastic_damping_form: i32,
    /// Pull-off force of adhesion, N, >= 0.
    pub adhesion_force: f64,
    /// Range of the adhesive pull, m, > 0.
    pub adhesion_range: f64,
    /// Number of an [`AdhesionForm`].
    pub adhesion_form: i32,
    /// Depth below the surface over which the pull of `Neck` and `Leaving` fades, m, >= 0; 0: it does not.
    pub adhesion_depth: f64,
    /// Stiffness of the Maxwell branches together, N/m^q, >= 0 (Maxwell 1867; Wiechert 1893).
    pub relaxation_stiffness: f64,
    /// Middle relaxation time, s, > 0.
    pub relaxation_time: f64,
    /// Decades between the relaxation times of the three branches, 0 to 6; 0: one time.
    pub relaxation_spread: f64,
    /// Power q of x that the branches hang on, 0.5 to 5; 0: the exponent p.
    pub relaxation_exponent: f64,
    /// Stiffness of the second layer, N/m^r, >= 0.
    pub secondary_stiffness: f64,
    /// Depth from which the second layer acts, m, >= 0.
    pub secondary_depth: f64,
    /// Power r of the second layer, 0.5 to 5.
    pub secondary_exponent: f64,
    /// Depth w over which the second layer comes to act, m, >= 0: its onsets are spread evenly over it (rough faces,
    /// after Greenwood and Williamson 1966), k2 (z^(r+1) - max(0, z - w)^(r+1))/((r+1) w) at z beyond its depth; 0: at once.
    pub secondary_width: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters {
            stiffness: 1e8,
            exponent: 1.5,
            hysteresis_damping: 0.0,
            damping_exponent_offset: 0.0,
            hysteresis_thinning_speed: 0.0,
            viscous_damping: 0.0,
            viscous_ramp: 0.0,
            viscous_thinning_speed: 0.0,
            yield_penetration: 0.0,
            plastic_ratio: 0.0,
            plastic_form: 0,
            plastic_unloading_exponent: 0.0,
            plastic_damping_form: 0,
            adhesion_force: 0.0,
            adhesion_range: 1e-5,
            adhesion_form: 0,
            adhesion_depth: 0.0,
            relaxation_stiffness: 0.0,
            relaxation_time: 1e-3,
            relaxation_spread: 0.0,
            relaxation_exponent: 0.0,
            secondary_stiffness: 0.0,
            secondary_depth: 0.0,
            secondary_exponent: 1.5,
            secondary_width: 0.0,
        }
    }
}

/// How a contact that has yielded unloads. d is the deepest penetration, y the yield depth, r the plastic ratio,
/// x_r the permanent set; below x_r nothing touches. Where the power of an unloading curve of `PermanentSet` is so low
/// that it would give back more than loading took (just beyond yield), the power that gives back just that is taken:
/// (p + 1)(1 - x_r/d) - 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum PlasticForm {
    /// x_r = r (d - y), F = F(d) ((x - x_r)/(d - x_r))^n (Lankarani and Nikravesh 1994; Oliver and Pharr 1992).
    PermanentSet = 0,
    /// x_r = r (d - y), F = F(d) (x - x_r)/(d - x_r), never above the loading curve: the straight, stiffer unloading
    /// of Walton and Braun 1986. At p = 1, y = 0: k2 = k1/(1 - r) and e = sqrt(k1/k2) = sqrt(1 - r) exactly.
    WaltonBraun = 1,
    /// Beyond y the loading goes on along its tangent at y; unloading is F = k_u (x - x_r)^p through the deepest
    /// point, k_u = k sqrt(k d^p/F(d)): the radius of curvature has grown by what the load fell short of the elastic
    /// one (Thornton 1997, eq. for R_p*, at p = 1.5). Neutral at p = 1.
    Thornton = 2,
}

impl PlasticForm {
    /// The form of a number; None for a number that has none.
    pub fn from_i32(n: i32) -> Option<Self> {
        match n {
            0 => Some(PlasticForm::PermanentSet),
            1 => Some(PlasticForm::WaltonBraun),
            2 => Some(PlasticForm::Thornton),
            _ => None,
        }
    }
}

/// How adhesion pulls. Fa is the pull-off force, R the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum AdhesionForm {
    /// Fa (1 - exp(-x/R)) at x > 0, both ways, nothing before touch (smoothed after Derjaguin, Muller and Toporov 1975).
    Contact = 0,
    /// Fa (1 - exp(-(a - x)/R)) where x is less than a, the deepest point since the last separation; outside
    /// the surface it fades linearly to zero at x = -R, where the neck breaks (after Johnson, Kendall and Roberts 1971).
    Neck = 1,
    /// Fa at x > 0, fading linearly to zero at x = -R, both ways, so it acts before touch too (after Derjaguin,
    /// Muller and Toporov 1975).
    Reach = 2,
    /// As `Neck`, but the pull is there as soon as the contact leaves its deepest point (built up over R/20), and
    /// R is how far it reaches out.
    Leaving = 3,
    /// Fa ((x + e)/R)^(p/2): the pull grows with the contact; e is how far the neck draws the faces together, none
    /// where x is at its deepest since the last separation, rising evenly to R at the surface; it breaks at x = -R
    /// (after Johnson, Kendall and Roberts 1971, whose pull goes with the contact radius to 3/2).
    Growing = 4,
}

impl AdhesionForm {
    /// The form of a number; None for a number that has none.
    pub fn from_i32(n: i32) -> Option<Self> {
        match n {
            0 => Some(AdhesionForm::Contact),
            1 => Some(AdhesionForm::Neck),
            3 => Some(AdhesionForm::Leaving),
            2 => Some(AdhesionForm::Reach),
            4 => Some(AdhesionForm::Growing),
            _ => None,
        }
    }
}

/// A parameter out of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// Name of the field.
    pub name: &'static str,
    /// What it was.
    pub value: f64,
    /// What it may be.
    pub expected: &'static str,
}

impl core::fmt::Display for ParameterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} is {}: give {}", self.name, self.value, self.expected)
    }
}

impl Parameters {
    /// Checks every range.
    ///
    /// # Errors
    /// The first parameter out of its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let check = |name, value: f64, ok: bool, expected| {
            if value.is_finite() && ok {
                Ok(())
            } else {
                Err(ParameterError { name, value, expected })
            }
        };
        let at_least_zero = |name, v: f64| check(name, v, v >= 0.0, "a finite number from 0 on");
        let power = |name, v: f64| check(name, v, (0.5..=5.0).contains(&v), "0.5 to 5");
        let power_or_0 = |name, v: f64| check(name, v, v == 0.0 || (0.5..=5.0).contains(&v), "0, or 0.5 to 5");
        let above_zero = |name, v: f64| check(name, v, v > 0.0, "a finite number above 0");
        above_zero("stiffness", self.stiffness)?;
        power("exponent", self.exponent)?;
        at_least_zero("hysteresis_damping", self.hysteresis_damping)?;
        let o = self.damping_exponent_offset;
        check("damping_exponent_offset", o, o + self.exponent >= 0.0 && o <= 5.0, "-exponent to 5")?;
        at_least_zero("hysteresis_thinning_speed", self.hysteresis_thinning_speed)?;
        at_least_zero("viscous_damping", self.viscous_damping)?;
        at_least_zero("viscous_ramp", self.viscous_ramp)?;
        at_least_zero("viscous_thinning_speed", self.viscous_thinning_speed)?;
        at_least_zero("yield_penetration", self.yield_penetration)?;
        check("plastic_ratio", self.plastic_ratio, (0.0..1.0).contains(&self.plastic_ratio), "0 to below 1")?;
        let form = PlasticForm::from_i32(self.plastic_form);
        check("plastic_form", f64::from(self.plastic_form), form.is_some(), "0, 1 or 2")?;
        if form == Some(PlasticForm::Thornton) && self.plastic_ratio > 0.0 {
            let y = self.yield_penetration;
            check("yield_penetration", y, y > 0.0, "a finite number above 0 with plastic_form 2")?;
            let p = self.exponent;
            check("exponent", p, p >= 1.0, "1 to 5 with plastic_form 2")?;
        }
        power_or_0("plastic_unloading_exponent", self.plastic_unloading_exponent)?;
        let form = self.plastic_damping_form;
        check("plastic_damping_form", f64::from(form), form == 0 || form == 1, "0 or 1")?;
        at_least_zero("adhesion_force", self.adhesion_force)?;
        above_zero("adhesion_range", self.adhesion_range)?;
        let form = AdhesionForm::from_i32(self.adhesion_form);
        check("adhesion_form", f64::from(self.adhesion_form), form.is_some(), "0, 1, 2, 3 or 4")?;
        at_least_zero("adhesion_depth", self.adhesion_depth)?;
        at_least_zero("relaxation_stiffness", self.relaxation_stiffness)?;
        above_zero("relaxation_time", self.relaxation_time)?;
        check("relaxation_spread", self.relaxation_spread, (0.0..=6.0).contains(&self.relaxation_spread), "0 to 6")?;
        power_or_0("relaxation_exponent", self.relaxation_exponent)?;
        at_least_zero("secondary_stiffness", self.secondary_stiffness)?;
        at_least_zero("secondary_depth", self.secondary_depth)?;
        power("secondary_exponent", self.secondary_exponent)?;
        at_least_zero("secondary_width", self.secondary_width)
    }
}
