//! What the search asks of a fitted structure: what it costs, what it gains, and whether what it leaves is noise.

use estimate::fitted::Fitted;

/// Gain in chi^2, beyond one parameter and over the overdispersion of the residual, from which a misfit counts as
/// detected. Held to under 1 % false alarms with the maximum over all candidates.
pub const DETECT: f64 = 45.0;
/// The same for a gain beyond a calibration's tolerance, where the prior sets the scale and nothing else inflates it.
pub const DETECT_TOLERANCE: f64 = 11.0;
/// Penalty of one more parameter, in chi^2.
pub const PENALTY: f64 = 4.0;
/// Overdispersion up to which a residual counts as noise.
pub const WHITE: f64 = 1.25;
/// The same where one more effect could hide in what lies between.
pub const WHITE_ALONE: f64 = 1.05;

/// Share of what the base leaves beyond noise up to which what a candidate leaves is a form that is not quite the one
/// present.
const LEFT: f64 = 0.05;

/// Mean square by which the stiffness of repeats differs, over that of repeat scatter, which no scatter has; and the
/// degrees of freedom from which it is judged.
const EXCESS_SCATTER: f64 = 12.0;
const EXCESS_SCATTER_FREEDOM: f64 = 2.0;
/// Share of that square which may stay where what the recordings differ by has been found.
const EXCESS_SCATTER_LEFT: f64 = 0.2;

/// Gain from which a candidate stands beside one that gains `top` and explains what there is: `share` of that, and in any
/// case what lies less than [`DETECT`] behind it.
pub fn least_beside(top: f64, share: f64) -> f64 {
    (share * top).min(top - DETECT)
}

/// A fitted structure, weighed against others.
pub trait Candidate {
    /// Whether its last effect is a calibration beyond its tolerance.
    fn calibrates(&self) -> bool;
    /// chi^2 with its penalty.
    fn cost(&self) -> f64;
    /// Fall of chi^2 from `from`, less the penalty of every parameter beyond one.
    fn gain(&self, from: &Fitted) -> f64;
    /// Whether it explains what `from` leaves: what is left is noise, or so little beside that that its form is not quite
    /// the one present.
    fn explains(&self, from: &Fitted) -> bool;
    /// Root mean square by which ln stiffness differs between recordings of one level, where that is more than repeats
    /// scatter by: something between the recordings changed it.
    fn excess_scatter(&self) -> Option<f64>;
    /// The excess scatter where it is still a good share of what it was in another fit (`from`): a course with order that
    /// is not quite the one found leaves a little.
    fn excess_scatter_left(&self, from: Option<f64>) -> Option<f64>;
}

impl Candidate for Fitted {
    fn calibrates(&self) -> bool {
        self.structure.last().is_some_and(|t| t.mechanism.hints.is_calibration && t.form.parameters.len() == 1)
    }

    fn cost(&self) -> f64 {
        self.chi2() + PENALTY * self.parameters()
    }

    fn gain(&self, from: &Fitted) -> f64 {
        let more = (self.parameters() - from.parameters() - 1.0).max(0.0);
        from.fit.point.chi2 - self.fit.point.chi2 - more * PENALTY
    }

    fn explains(&self, from: &Fitted) -> bool {
        let left = self.overdispersion();
        left <= WHITE || left - 1.0 <= LEFT * (from.overdispersion() - 1.0)
    }

    fn excess_scatter(&self) -> Option<f64> {
        let problem = self.problem();
        let of = |level: usize| -> Vec<f64> {
            let own = self.data.records.iter().zip(&self.fit.point.locals).filter(|(r, _)| r.level == level);
            own.map(|(_, l)| problem.local(l).stiffness).collect()
        };
        let levels = self.data.records.iter().map(|r| r.level).max().unwrap_or(0);
        let (sum, freedom) = (0..=levels).map(of).filter(|l| l.len() > 1).fold((0.0, 0.0), |(sum, freedom), l| {
            let mean = l.iter().sum::<f64>() / l.len() as f64;
            (sum + l.iter().map(|s| (s - mean).powi(2)).sum::<f64>(), freedom + l.len() as f64 - 1.0)
        });
        let (square, most) = (sum / freedom, EXCESS_SCATTER * self.data.repeat_scatter.powi(2));
        let beyond = freedom >= EXCESS_SCATTER_FREEDOM
            && square > most
            // slow noise moves what each recording is fitted to, too
            && square > most * self.overdispersion();
        beyond.then(|| square.sqrt())
    }

    fn excess_scatter_left(&self, from: Option<f64>) -> Option<f64> {
        self.excess_scatter().filter(|s| from.is_none_or(|f| s * s > EXCESS_SCATTER_LEFT * f * f))
    }
}
