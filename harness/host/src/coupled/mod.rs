//! A user's FMUs as the forward model's machine: opened once, instantiated once a thread, started anew for every run.

mod fit;
mod hand;
mod identify;
mod layout;
mod propose;
mod running;

use crate::Isolation;
use anyhow::Result;
pub use hand::{handed_back, replaceable, Ours};
use layout::Layout;
use plant::machine::{Facts, Machine, Running};
pub use propose::{propose, Proposal, ProposedBond};
use record::{Campaign, FmuSystem};
use running::Sitting;
use std::cell::RefCell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

/// Most different troubles kept.
const TROUBLES: usize = 20;
/// Times the longest run with the values of the system file that a call may take in a fit, and the least time that is given.
const RUNS: u32 = 10;
const LEAST: Duration = Duration::from_secs(1);

static IDS: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// What sits in this thread, by machine.
    static SITTINGS: RefCell<Vec<(u64, Weak<()>, Sitting)>> = const { RefCell::new(Vec::new()) };
}

/// The FMUs of a campaign, opened, and what was found out about them.
pub struct Fmus {
    id: u64,
    /// There as long as this is: instances in other threads know by it that nobody needs them any more.
    alive: Arc<()>,
    layout: Layout,
    facts: Facts,
    troubles: Mutex<Vec<String>>,
    /// Longest run so far while nothing was known of the FMUs, ms.
    run: AtomicU64,
    /// Longest time that a call may take; None while that is found out.
    longest: Option<Duration>,
}

impl std::fmt::Debug for Fmus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Fmus({})", self.layout.system.path.display())
    }
}

impl Fmus {
    /// Opens the FMUs of a campaign of kind `system`, runs every recording once as the system file has it, and finds out
    /// what the diagnosis has to know: masses, contacts, channels, and how the free variables move them.
    ///
    /// # Errors
    /// What is wrong with campaign.toml, the system or an FMU: file, line or call, and the cure.
    pub fn open(c: &Campaign, isolation: &Isolation) -> Result<Option<Arc<Fmus>>> {
        let Some(of) = &c.system else { return Ok(None) };
        Ok(Some(Arc::new(Fmus::identified(of, c, Fmus::layout(of, c, isolation)?)?)))
    }

    /// Recordings of a campaign of kind `system` that its FMUs do not run through with the values of the system file: place in the
    /// campaign, and what was refused. None of another kind.
    ///
    /// # Errors
    /// What is wrong with campaign.toml, the system or an FMU whatever the recording.
    pub fn refused(c: &Campaign, isolation: &Isolation) -> Result<Vec<(usize, anyhow::Error)>> {
        let Some(of) = &c.system else { return Ok(Vec::new()) };
        let fmus = Fmus::unidentified(Fmus::layout(of, c, isolation)?);
        identify::refused(&fmus, of, c)
    }

    fn layout(of: &FmuSystem, c: &Campaign, isolation: &Isolation) -> Result<Layout> {
        let sets: Vec<_> = c.recordings.iter().map(|r| r.set.clone()).collect();
        Layout::new(of, &sets, isolation)
    }

    fn unidentified(layout: Layout) -> Fmus {
        Fmus {
            id: IDS.fetch_add(1, Ordering::Relaxed),
            alive: Arc::new(()),
            layout,
            facts: Facts::default(),
            troubles: Mutex::default(),
            run: AtomicU64::new(0),
            longest: None,
        }
    }

    fn identified(of: &FmuSystem, c: &Campaign, layout: Layout) -> Result<Fmus> {
        let mut fmus = Fmus::unidentified(layout);
        for b in identify::turned(&fmus, of, c)? {
            fmus.layout.turn(b);
        }
        fmus.facts = identify::identify(&fmus, of, c)?;
        // what hangs at some values is tried often: each time costs this much
        fmus.longest = Some(LEAST.max(RUNS * Duration::from_millis(fmus.run.load(Ordering::Relaxed))));
        Ok(fmus)
    }

    /// Starts recording `set` with the free variables at `values`, and hands it to `with`.
    fn start(
        &self,
        set: usize,
        values: &[f64],
        with: &mut dyn FnMut(&mut running::Moving<'_>) -> Result<()>,
    ) -> Result<()> {
        let mut sitting = self.seated()?;
        let since = Instant::now();
        let done = sitting.start(&self.layout, set, values, self.longest).and_then(|mut m| {
            let done = with(&mut m);
            done.map_err(|e| running::with_log(&m, e))
        });
        // whatever has refused once is made anew
        if done.is_ok() {
            if self.longest.is_none() {
                let took = u64::try_from(since.elapsed().as_millis()).unwrap_or(u64::MAX);
                self.run.fetch_max(took, Ordering::Relaxed);
            }
            SITTINGS.with_borrow_mut(|all| all.push((self.id, Arc::downgrade(&self.alive), sitting)));
        }
        done
    }

    /// What sits in this thread; made where nothing does.
    fn seated(&self) -> Result<Sitting> {
        let found = SITTINGS.with_borrow_mut(|all| {
            all.retain(|s| s.1.strong_count() > 0);
            all.iter().position(|s| s.0 == self.id).map(|i| all.swap_remove(i).2)
        });
        found.map_or_else(|| Sitting::new(&self.layout), Ok)
    }
}

impl Machine for Fmus {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn run(
        &self,
        set: usize,
        free: &[f64; mechanisms::physics::FREE],
        with: &mut dyn FnMut(&mut dyn Running) -> Result<()>,
    ) -> Result<()> {
        let values: Vec<f64> = self.facts.free.iter().zip(free).map(|(f, away)| f.value(*away)).collect();
        self.start(set, &values, &mut |m| with(m))
    }

    fn keep_trouble(&self, what: &anyhow::Error) {
        let text = format!("{what:#}");
        let mut all = self.troubles.lock().unwrap_or_else(PoisonError::into_inner);
        // the same call at another time is the same trouble
        let plain = |t: &str| t.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
        if all.len() < TROUBLES && all.iter().all(|t| plain(t) != plain(&text)) {
            all.push(text);
        }
    }

    fn troubles(&self) -> Vec<String> {
        self.troubles.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
