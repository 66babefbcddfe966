//! The best of all subsets of given contacts, exactly, without evaluating most of them.
//!
//! For any unit twist v, h(v) = max_ij ⟨v, w_ij⟩ bounds Q from above, and the maximum over a
//! subset is that of its contacts' own maxima, which depend on the contact and v alone. So a table
//! of these maxima for a few hundred directions answers "is Q below the best so far?" for most
//! subsets by the conjunction of a bit mask per contact. The directions are those in which earlier
//! subsets failed.
//!
//! Where every finger has a limit of its own, the hull is the sum of the contacts' hulls, each with
//! the origin, and h(v) the sum of their maxima where these are positive.

use crate::contact::{Contact, Frame, FrictionCone, Norm};
use crate::error::Error;
use crate::quality::{Evaluator, LARGEST_ERROR, Twist, Weakest};
use glam::DVec3;
use multiversion::multiversion;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

mod board;
mod together;

use board::{Board, Leave, Running};
pub use together::Together;

const WORDS: usize = 4;
/// One bit per direction.
type Mask = [u64; WORDS];
const DIRECTIONS: usize = 64 * WORDS;

/// A subset is passed over where a bound of Q is below the threshold by so much of the longest
/// wrench. The bounds are right to rounding, but the values that enter err by the perturbation of
/// the expanding polytope, which is less than this: what is passed over cannot depend on the order
/// in which threads come by.
const MARGIN: f64 = 2.0 * LARGEST_ERROR;

/// Some of the given contacts, by index, and their Q_l.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranked {
    /// Q_l > 0.
    pub quality: f64,
    /// Ascending indices of the contacts.
    pub indices: Vec<usize>,
}

/// The `top` best force-closure grasps among all subsets of `size` of the `contacts`, best first,
/// equal ones by their indices; fewer if there are fewer. The result does not depend on `threads`.
///
/// `frictions` are the coefficients of the contacts if each has one of its own, else empty.
///
/// `progress(done, total)` is called now and then and at the end from the calling thread, in
/// subsets, and may ask to stop: then the answer is [`Error::Interrupted`].
#[expect(clippy::too_many_arguments, reason = "what to search among, and how")]
pub fn best_subsets(
    contacts: &[Contact],
    frictions: &[f64],
    center_of_mass: DVec3,
    cone: &FrictionCone,
    size: usize,
    top: usize,
    threads: usize,
    progress: impl FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<Vec<Ranked>, Error> {
    best_subsets_together(
        contacts,
        frictions,
        center_of_mass,
        cone,
        size,
        top,
        threads,
        None,
        progress,
    )
}

/// The same among those subsets of which all pairs may be `together`.
#[expect(clippy::too_many_arguments, reason = "what to search among, and how")]
pub fn best_subsets_together(
    contacts: &[Contact],
    frictions: &[f64],
    center_of_mass: DVec3,
    cone: &FrictionCone,
    size: usize,
    top: usize,
    threads: usize,
    together: Option<&Together>,
    mut progress: impl FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<Vec<Ranked>, Error> {
    let n = contacts.len();
    if !frictions.is_empty() && frictions.len() != n {
        return Err(Error::Count {
            name: "frictions",
            wanted: n,
            got: frictions.len(),
        });
    }
    let total = subsets(n, size);
    if size == 0 || total == 0 || top == 0 {
        return Ok(Vec::new());
    }
    let board = Board::new(top);
    let mut first = Worker::new(contacts, frictions, center_of_mass, cone, size, &board);
    first.together = together;
    first.seed(total);
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let done = AtomicU64::new(0);
    let running = Running::new(threads.max(1));
    let work = |mut worker: Worker| {
        let _guard = Leave(&running);
        loop {
            let a = next.fetch_add(1, Ordering::Relaxed);
            if a + size > n || stop.load(Ordering::Relaxed) {
                break;
            }
            worker.all_from(&mut vec![a], &stop);
            done.fetch_add(subsets(n - a - 1, size - 1), Ordering::Relaxed);
        }
    };
    let mut report = || {
        if progress(done.load(Ordering::Relaxed), total).is_break() {
            stop.store(true, Ordering::Relaxed);
        }
    };
    // A short search is over before threads have started.
    if threads <= 1 && total < 100_000 {
        work(first);
        report();
    } else {
        std::thread::scope(|scope| {
            for _ in 1..threads.max(1) {
                let worker = first.clone();
                scope.spawn(|| work(worker));
            }
            scope.spawn(|| work(first));
            while !running.is_over() {
                report();
            }
            report();
        });
    }
    if stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    Ok(board.into_best())
}

/// The same for some triples only, in the order in which they are worth trying; on this thread.
pub(crate) fn best_of(
    contacts: &[Contact],
    frictions: &[f64],
    center_of_mass: DVec3,
    cone: &FrictionCone,
    top: usize,
    triples: impl Iterator<Item = [usize; 3]>,
) -> Vec<Ranked> {
    let board = Board::new(top);
    let mut worker = Worker::new(contacts, frictions, center_of_mass, cone, 3, &board);
    for mut triple in triples {
        if worker.may_enter(&triple) {
            worker.evaluate(&mut triple);
        }
    }
    board.into_best()
}

/// n choose k, or the largest number if it is more.
fn subsets(n: usize, k: usize) -> u64 {
    if k > n {
        return 0;
    }
    let product = (0..k.min(n - k) as u128).try_fold(1u128, |product, i| {
        product.checked_mul(n as u128 - i).map(|p| p / (i + 1))
    });
    product.map_or(u64::MAX, |p| u64::try_from(p).unwrap_or(u64::MAX))
}

#[derive(Clone)]
struct Worker<'a> {
    contacts: &'a [Contact],
    /// Of each contact, or empty.
    frictions: &'a [f64],
    center: DVec3,
    board: &'a Board,
    evaluator: Evaluator,
    /// Which contacts may be in a grasp together; all, if not given.
    together: Option<&'a Together>,
    /// Contacts per grasp, and those of the grasp that is evaluated.
    size: usize,
    grasp: Vec<Contact>,
    grasp_frictions: Vec<f64>,
    /// Wrenches of all contacts, `per_contact` each.
    wrenches: Vec<Twist>,
    per_contact: usize,
    /// How far a support value must be below the threshold.
    margin: f64,
    norm: Norm,
    /// Per direction, the maximum of ⟨v, w⟩ over each contact's wrenches.
    supports: Vec<Vec<f64>>,
    /// Where the next direction goes once the table is full.
    oldest: usize,
    /// Per contact, in which directions its maximum is below the threshold.
    masks: Vec<Mask>,
    threshold: f64,
}

impl<'a> Worker<'a> {
    fn new(
        contacts: &'a [Contact],
        frictions: &'a [f64],
        center: DVec3,
        cone: &FrictionCone,
        size: usize,
        board: &'a Board,
    ) -> Self {
        let mut own = cone.clone();
        if !frictions.is_empty() {
            own.set_frictions(frictions);
        }
        let own = &own;
        let wrenches: Vec<Twist> = contacts
            .iter()
            .enumerate()
            .flat_map(|(i, contact)| {
                let frame = Frame::new(contact.normal);
                (0..own.generators()).map(move |j| {
                    let (force, spin) = own.generator(i, j);
                    let force = frame.turn(force);
                    let torque = (contact.point - center).cross(force) + spin * contact.normal;
                    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
                })
            })
            .collect();
        let longest = wrenches
            .iter()
            .flatten()
            .fold(0.0_f64, |longest, x| longest.max(x.abs()));
        Self {
            contacts,
            frictions,
            center,
            board,
            evaluator: Evaluator::new(cone),
            together: None,
            size,
            grasp: Vec::new(),
            grasp_frictions: Vec::new(),
            wrenches,
            per_contact: cone.generators(),
            margin: longest
                * MARGIN
                * if own.norm() == Norm::Each {
                    size as f64
                } else {
                    1.0
                },
            norm: own.norm(),
            supports: Vec::new(),
            oldest: 0,
            masks: vec![[0; WORDS]; contacts.len()],
            threshold: 0.0,
        }
    }

    /// A first threshold and first directions: some subsets spread over all, then the best of
    /// them improved by exchanging one contact at a time.
    fn seed(&mut self, total: u64) {
        let n = self.contacts.len();
        // A fixed linear congruential sequence: the result must not depend on chance.
        let mut state = 1u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            ((state >> 33) as usize) % n
        };
        let mut best = (0.0, (0..self.size).collect::<Vec<_>>());
        for _ in 0..(total / 16).min(512) {
            let mut indices: Vec<usize> = (0..self.size).map(|_| draw()).collect();
            let quality = self.evaluate(&mut indices);
            if quality > best.0 {
                best = (quality, indices);
            }
        }
        for slot in (0..self.size).cycle().take(2 * self.size) {
            for other in 0..n {
                let mut indices = best.1.clone();
                indices[slot] = other;
                let quality = self.evaluate(&mut indices);
                if quality > best.0 {
                    best = (quality, indices);
                }
            }
        }
    }

    /// All subsets that begin with the chosen ones, which ascend.
    fn all_from(&mut self, chosen: &mut Vec<usize>, stop: &AtomicBool) {
        let n = self.contacts.len();
        let last = chosen[chosen.len() - 1];
        if chosen.len() == self.size {
            self.evaluate(chosen);
            return;
        }
        if chosen.len() + 1 < self.size {
            for next in last + 1..n {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                if !self.fits(chosen, next) {
                    continue;
                }
                chosen.push(next);
                self.all_from(chosen, stop);
                chosen.pop();
            }
            return;
        }
        let mut next = last + 1;
        loop {
            next = match self.together {
                Some(together) => together.next(chosen, next).unwrap_or(n),
                None => next,
            };
            let fitting = next;
            // A new threshold or direction changes the masks: look at them afresh each time.
            next = match self.norm {
                Norm::Sum => first_open(&self.common(chosen), &self.masks, next),
                Norm::Each => (next..n).find(|&k| self.reaches(chosen, k)).unwrap_or(n),
            };
            if next >= n {
                break;
            }
            if next > fitting && !self.fits(chosen, next) {
                continue;
            }
            chosen.push(next);
            self.evaluate(chosen);
            chosen.pop();
            next += 1;
        }
    }

    /// May another contact be with all of the chosen ones?
    fn fits(&self, chosen: &[usize], another: usize) -> bool {
        let Some(together) = self.together else {
            return true;
        };
        chosen.iter().all(|&k| together.allows(k, another))
    }

    /// Directions in which all these contacts stay below the threshold.
    fn common(&self, indices: &[usize]) -> Mask {
        let mut common = [u64::MAX; WORDS];
        for &index in indices {
            for (word, own) in common.iter_mut().zip(&self.masks[index]) {
                *word &= own;
            }
        }
        common
    }

    /// Is there no direction in which the grasp is known to stay below the threshold?
    fn may_enter(&self, indices: &[usize]) -> bool {
        match self.norm {
            Norm::Sum => self.common(indices) == [0; WORDS],
            Norm::Each => self.reaches(&indices[1..], indices[0]),
        }
    }

    /// The same for fingers that add up.
    fn reaches(&self, chosen: &[usize], another: usize) -> bool {
        let bar = self.threshold - self.margin;
        self.supports.iter().all(|support| {
            let sum: f64 = chosen.iter().map(|&k| support[k].max(0.0)).sum();
            sum + support[another].max(0.0) >= bar
        })
    }

    /// Q of some contacts if it reaches the threshold, else 0; tells the board. Sorts them.
    fn evaluate(&mut self, indices: &mut [usize]) -> f64 {
        indices.sort_unstable();
        if indices.windows(2).any(|pair| pair[0] == pair[1])
            || self.together.is_some_and(|pairs| !pairs.allow_all(indices))
        {
            return 0.0;
        }
        if self.board.threshold() > self.threshold {
            self.raise_threshold();
        }
        self.grasp.clear();
        self.grasp.extend(indices.iter().map(|&i| self.contacts[i]));
        if !self.frictions.is_empty() {
            self.grasp_frictions.clear();
            self.grasp_frictions
                .extend(indices.iter().map(|&i| self.frictions[i]));
            self.evaluator.set_frictions(&self.grasp_frictions);
        }
        let weakest = self
            .evaluator
            .weakest_up_to(&self.grasp, self.center, self.threshold);
        let Some(Weakest { quality, direction }) = weakest else {
            return 0.0;
        };
        if quality < self.threshold || quality == 0.0 {
            self.add_direction(direction);
            return 0.0;
        }
        self.board.offer(Ranked {
            quality,
            indices: indices.to_vec(),
        });
        if self.supports.len() < DIRECTIONS {
            self.add_direction(direction);
        }
        quality
    }

    fn add_direction(&mut self, direction: Twist) {
        let supports: Vec<f64> = supports(&self.wrenches, self.per_contact, &direction);
        let slot = self.supports.len();
        let slot = if slot < DIRECTIONS {
            self.supports.push(supports);
            slot
        } else {
            self.oldest = (self.oldest + 1) % DIRECTIONS;
            self.supports[self.oldest] = supports;
            self.oldest
        };
        self.mark(slot);
    }

    fn raise_threshold(&mut self) {
        self.threshold = self.board.threshold();
        for slot in 0..self.supports.len() {
            self.mark(slot);
        }
    }

    /// Sets the bits of one direction.
    fn mark(&mut self, slot: usize) {
        if self.norm == Norm::Each {
            return;
        }
        let bar = self.threshold - self.margin;
        let (word, bit) = (slot / 64, slot % 64);
        for (mask, &support) in self.masks.iter_mut().zip(&self.supports[slot]) {
            mask[word] = mask[word] & !(1 << bit) | u64::from(support < bar) << bit;
        }
    }
}

/// The first index from `from` on whose mask has no bit in common with the pair's.
#[multiversion(targets("x86_64+avx+avx2"))]
fn first_open(pair: &Mask, masks: &[Mask], from: usize) -> usize {
    for (offset, mask) in masks[from..].iter().enumerate() {
        let mut common = 0;
        for word in 0..WORDS {
            common |= pair[word] & mask[word];
        }
        if common == 0 {
            return from + offset;
        }
    }
    masks.len()
}

/// max ⟨direction, w⟩ over each contact's wrenches.
#[multiversion(targets("x86_64+avx+avx2"))]
fn supports(wrenches: &[Twist], per_contact: usize, direction: &Twist) -> Vec<f64> {
    wrenches
        .chunks_exact(per_contact)
        .map(|own| {
            own.iter()
                .map(|w| w.iter().zip(direction).map(|(a, b)| a * b).sum::<f64>())
                .fold(f64::NEG_INFINITY, f64::max)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_subsets_do_not_overflow() {
        assert_eq!(subsets(200, 3), 1_313_400);
        assert_eq!(subsets(3, 4), 0);
        assert_eq!(subsets(10_000, 5_000), u64::MAX);
    }
}
