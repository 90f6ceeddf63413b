//! The lease of the evaluation at hand, renewed by a thread of its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use salp_protocol::problem::STALE_LEASE;
use salp_protocol::{Directive, EvaluationId};
use tracing::{info, warn};

use crate::client::Client;

/// What became of a lease.
#[derive(Debug, Default)]
pub struct Lease {
    cancelled: AtomicBool,
    lost: AtomicBool,
    drain: AtomicBool,
}

impl Lease {
    /// Whether the evaluation is to be stopped, for whatever reason.
    pub fn is_over(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed) || self.lost.load(Ordering::Relaxed)
    }

    /// Whether it was lost: it could not be renewed in time, or another worker has it.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Whether the worker was told to end after this evaluation.
    pub fn wants_drain(&self) -> bool {
        self.drain.load(Ordering::Relaxed)
    }
}

/// The thread that renews leases. It lives as long as this handle.
pub struct Heart {
    shared: Arc<Shared>,
}

struct Shared {
    at_hand: Mutex<AtHand>,
    changed: Condvar,
}

#[derive(Default)]
struct AtHand {
    beat: Option<Beat>,
    ended: bool,
}

#[derive(Clone)]
struct Beat {
    evaluation: EvaluationId,
    fence: i64,
    period: Duration,
    /// When the lease ends by this machine's clock, counted from before the claim or renewal was answered.
    until: Instant,
    length: Duration,
    next: Instant,
    lease: Arc<Lease>,
}

/// An evaluation whose lease is renewed until this is dropped.
pub struct Held<'a> {
    /// What became of it.
    pub lease: Arc<Lease>,
    heart: &'a Heart,
}

impl Heart {
    /// Starts the thread. `client` should give up well before a lease ends.
    ///
    /// # Errors
    /// Where the system has no thread to give.
    pub fn start(client: Client) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            at_hand: Mutex::default(),
            changed: Condvar::new(),
        });
        let theirs = Arc::clone(&shared);
        thread::Builder::new()
            .name("heartbeat".into())
            .spawn(move || theirs.run(&client))?;
        Ok(Self { shared })
    }

    /// Renews the lease of an evaluation from now on, every third of its length.
    pub fn hold(&self, evaluation: EvaluationId, fence: i64, length: Duration) -> Held<'_> {
        let lease = Arc::new(Lease::default());
        let now = Instant::now();
        let period = length / 3;
        self.shared.lock().beat = Some(Beat {
            evaluation,
            fence,
            period,
            until: now + length,
            length,
            next: now + period,
            lease: Arc::clone(&lease),
        });
        self.shared.changed.notify_one();
        Held { lease, heart: self }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        self.heart.shared.lock().beat = None;
        self.heart.shared.changed.notify_one();
    }
}

impl Drop for Heart {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.changed.notify_one();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, AtHand> {
        // Nothing panics while it holds the lock; if it did, the data would still be whole.
        self.at_hand.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self, client: &Client) {
        let mut at_hand = self.lock();
        while !at_hand.ended {
            let pause = at_hand.beat.as_ref().map_or(Duration::MAX, |beat| {
                beat.next.saturating_duration_since(Instant::now())
            });
            if !pause.is_zero() {
                at_hand = match pause {
                    Duration::MAX => self
                        .changed
                        .wait(at_hand)
                        .unwrap_or_else(PoisonError::into_inner),
                    pause => {
                        self.changed
                            .wait_timeout(at_hand, pause)
                            .unwrap_or_else(PoisonError::into_inner)
                            .0
                    }
                };
                continue;
            }
            let Some(mut beat) = at_hand.beat.clone() else {
                continue;
            };
            drop(at_hand);
            renew(client, &mut beat);
            at_hand = self.lock();
            if let Some(current) = &mut at_hand.beat
                && (&current.evaluation, current.fence) == (&beat.evaluation, beat.fence)
            {
                *current = beat;
            }
        }
    }
}

fn renew(client: &Client, beat: &mut Beat) {
    let asked = Instant::now();
    let Beat {
        evaluation, lease, ..
    } = &*beat;
    match client.heartbeat(evaluation, beat.fence) {
        Ok(answer) => {
            match answer.directive {
                Directive::Continue => {}
                Directive::Cancel => {
                    info!(%evaluation, "told to stop this evaluation");
                    lease.cancelled.store(true, Ordering::Relaxed);
                }
                Directive::Drain => lease.drain.store(true, Ordering::Relaxed),
            }
            beat.until = asked + beat.length;
            beat.next = asked + beat.period;
        }
        Err(refused) if refused.problem() == Some(STALE_LEASE) => {
            info!(%evaluation, "another worker has this evaluation now");
            lease.lost.store(true, Ordering::Relaxed);
            beat.next = asked + beat.length;
        }
        Err(failure) => {
            if asked >= beat.until && !lease.is_lost() {
                warn!(%evaluation, "the lease could not be renewed in time; stopping: {failure}");
                lease.lost.store(true, Ordering::Relaxed);
            }
            // Sooner than the period: the coordinator may be back before the lease ends.
            beat.next = asked + beat.period / 4;
        }
    }
}
