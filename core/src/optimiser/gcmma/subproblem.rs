//! The subproblem, by a primal-dual interior-point method.
//!
//! ```text
//! min f0~(w) + sum_i (c y_i + y_i^2 / 2)   over alpha <= w <= beta, y >= 0
//! with fi~(w) - y_i <= 0
//! ```
//! The elastic y make it feasible always. With s the slacks of the rows, lambda their multipliers, mu those of y >= 0,
//! xi and eta those of the box, Newton's method is applied to the conditions of optimality with every complementarity
//! relaxed to eps, which falls to nothing. Of the linearised system remain, after the diagonal blocks are eliminated,
//!
//! ```text
//! [ Dx  G' ] [ dw      ]     [ dx ]
//! [ G  -Dl ] [ dlambda ] = - [ dl ]
//! ```
//! solved for the smaller of w and lambda ([`super::newton`]). Svanberg 2007, section 5, with eps taken from the present
//! complementarity instead of a fixed sequence. Where no point of the box satisfies steep rows it may end early: what it has
//! is inside the box and is judged by the approximations' values there, so the step is only shorter than it could be.

use super::{
    model::{Model, Terms},
    newton::{self, System},
};

/// Cost of an elastic variable: beyond any multiplier that a scaled row of a sound problem has.
const ELASTIC: f64 = 1000.0;
const MOST_FAST: usize = 35;
const MOST_CAREFUL: usize = 100;
const MOST_HALVINGS: usize = 12;
/// Relaxation and residual at which the solution is good enough, the steepest slope of each function being 1.
const GOOD_RELAXATION: f64 = 1e-8;
const GOOD_RESIDUAL: f64 = 1e-7;
/// A product smaller than this share of the mean asks for a step towards the centre.
const OFF_CENTRE: f64 = 1e-3;
/// Share of the way to the nearest positivity bound that a step may take.
const TO_BOUNDARY: f64 = 0.99;

/// What is to be minimised.
pub(super) struct Subproblem<'a> {
    pub model: &'a Model,
    pub rho: &'a [f64],
    pub lower: &'a [f64],
    pub upper: &'a [f64],
}

/// Where it is least.
pub(super) struct Solution {
    pub step: Vec<f64>,
    /// Multiplier of each row, in scaled form.
    pub multipliers: Vec<f64>,
}

/// All unknowns.
#[derive(Clone)]
struct Unknowns {
    w: Vec<f64>,
    y: Vec<f64>,
    lambda: Vec<f64>,
    s: Vec<f64>,
    mu: Vec<f64>,
    xi: Vec<f64>,
    eta: Vec<f64>,
}

/// Functions and derivatives at a point.
struct Here {
    terms: Vec<Terms>,
    /// Rows.
    values: Vec<f64>,
    /// d Lagrangian / d w and its diagonal second derivative.
    first: Vec<f64>,
    second: Vec<f64>,
}

struct Solver<'a> {
    sub: &'a Subproblem<'a>,
    /// Variables with room to move.
    free: Vec<usize>,
    /// Place of each variable among the free ones.
    place: Vec<Option<usize>>,
    /// Rows that can be active in the box, as indices into the model's functions.
    rows: Vec<usize>,
    alpha: Vec<f64>,
    beta: Vec<f64>,
}

impl Subproblem<'_> {
    pub fn solve(&self) -> Solution {
        let solver = Solver::new(self);
        let unknowns = solver.run();
        let mut step = vec![0.0; self.lower.len()];
        for (place, &j) in solver.free.iter().enumerate() {
            step[j] = unknowns.w[place];
        }
        let mut multipliers = vec![0.0; self.model.functions.len() - 1];
        for (lambda, &row) in unknowns.lambda.iter().zip(&solver.rows) {
            multipliers[row - 1] = *lambda;
        }
        Solution { step, multipliers }
    }
}

impl<'a> Solver<'a> {
    fn new(sub: &'a Subproblem<'a>) -> Self {
        let n = sub.lower.len();
        let free: Vec<usize> = (0..n)
            .filter(|&j| sub.upper[j] - sub.lower[j] > 1e-14)
            .collect();
        let mut place = vec![None; n];
        for (index, &j) in free.iter().enumerate() {
            place[j] = Some(index);
        }
        // A convex function is largest at an end of its interval, so a row's largest value in the box is a plain sum.
        let ends: Vec<[Terms; 2]> = (0..n)
            .map(|j| [sub.lower[j], sub.upper[j]].map(Terms::at))
            .collect();
        let can_be_active = |&row: &usize| {
            let function = &sub.model.functions[row];
            let rho = sub.rho[row];
            let mut slope = vec![0.0; n];
            for &(j, g) in &function.slopes {
                slope[j] = g;
            }
            let most = |j: usize| {
                let end = |t: &Terms| function.part(t, slope[j], 0) + rho * t.rho(0);
                end(&ends[j][0]).max(end(&ends[j][1]))
            };
            function.value + (0..n).map(most).sum::<f64>() > 0.0
        };
        Self {
            rows: (1..sub.model.functions.len())
                .filter(can_be_active)
                .collect(),
            alpha: free.iter().map(|&j| sub.lower[j]).collect(),
            beta: free.iter().map(|&j| sub.upper[j]).collect(),
            sub,
            free,
            place,
        }
    }

    fn start(&self) -> Unknowns {
        let m = self.rows.len();
        let middle = |(a, b): (&f64, &f64)| f64::midpoint(*a, *b);
        let w: Vec<f64> = self.alpha.iter().zip(&self.beta).map(middle).collect();
        // Every row satisfied, or its slack 1; every product 1.
        let s: Vec<f64> = self
            .values(&w)
            .iter()
            .map(|value| (-value).max(1.0))
            .collect();
        let bound = |room: f64| (1.0 / room).clamp(1.0, 1e4);
        Unknowns {
            xi: w
                .iter()
                .zip(&self.alpha)
                .map(|(w, a)| bound(w - a))
                .collect(),
            eta: w
                .iter()
                .zip(&self.beta)
                .map(|(w, b)| bound(b - w))
                .collect(),
            y: vec![1.0 / ELASTIC; m],
            lambda: s.iter().map(|s| 1.0 / s).collect(),
            s,
            mu: vec![ELASTIC; m],
            w,
        }
    }

    /// Svanberg's start, in the middle of everything.
    fn careful_start(&self) -> Unknowns {
        let m = self.rows.len();
        Unknowns {
            y: vec![1.0; m],
            lambda: vec![1.0; m],
            s: vec![1.0; m],
            mu: vec![0.5 * ELASTIC; m],
            ..self.start()
        }
    }

    /// Rows at a point.
    fn values(&self, w: &[f64]) -> Vec<f64> {
        let n = w.len();
        let nothing = Unknowns {
            w: w.to_vec(),
            y: Vec::new(),
            lambda: vec![0.0; self.rows.len()],
            s: Vec::new(),
            mu: Vec::new(),
            xi: vec![0.0; n],
            eta: vec![0.0; n],
        };
        self.here(&nothing).values
    }

    fn here(&self, at: &Unknowns) -> Here {
        let model = self.sub.model;
        let terms: Vec<Terms> = at.w.iter().map(|w| Terms::at(*w)).collect();
        let even: f64 = terms.iter().map(|t| t.rho(0)).sum();
        let n = self.free.len();
        let mut linear_sum = vec![0.0; n];
        let (mut odd_sum, mut even_sum, mut rho_sum) = (vec![0.0; n], vec![0.0; n], 0.0);
        let mut values = Vec::with_capacity(self.rows.len());
        let objective = std::iter::once((0, 1.0));
        for (row, weight) in
            objective.chain(self.rows.iter().copied().zip(at.lambda.iter().copied()))
        {
            let function = &model.functions[row];
            let mut value = function.value + self.sub.rho[row] * even;
            for &(j, g) in &function.slopes {
                if let Some(place) = self.place[j] {
                    value += function.part(&terms[place], g, 0);
                    if function.linear {
                        linear_sum[place] += weight * g;
                    } else {
                        odd_sum[place] += weight * g;
                        even_sum[place] += weight * g.abs();
                    }
                }
            }
            rho_sum += weight * self.sub.rho[row];
            if row > 0 {
                values.push(value);
            }
        }
        let derivative = |order: usize| {
            (0..n)
                .map(|j| {
                    let t = &terms[j];
                    linear_sum[j] * t.w[order]
                        + odd_sum[j] * t.a[order]
                        + even_sum[j] * (t.part(1.0, order) - t.a[order])
                        + rho_sum * t.rho(order)
                })
                .collect()
        };
        Here {
            first: derivative(1),
            second: derivative(2),
            terms,
            values,
        }
    }

    /// Residuals of the conditions relaxed by `eps`, folded by `fold`.
    fn residual(&self, at: &Unknowns, here: &Here, eps: f64, fold: fn(f64, f64) -> f64) -> f64 {
        let mut total: f64 = 0.0;
        let mut add = |residual: f64| total = fold(total, residual);
        for j in 0..at.w.len() {
            let (low, high) = (at.w[j] - self.alpha[j], self.beta[j] - at.w[j]);
            add(here.first[j] - at.xi[j] + at.eta[j]);
            add(at.xi[j] * low - eps);
            add(at.eta[j] * high - eps);
        }
        for i in 0..at.y.len() {
            add(ELASTIC + at.y[i] - at.lambda[i] - at.mu[i]);
            add(here.values[i] - at.y[i] + at.s[i]);
            add(at.mu[i] * at.y[i] - eps);
            add(at.lambda[i] * at.s[i] - eps);
        }
        total
    }

    /// Largest residual.
    fn largest(&self, at: &Unknowns, here: &Here, eps: f64) -> f64 {
        self.residual(at, here, eps, |most, residual| most.max(residual.abs()))
    }

    /// Sum of squares, along which Newton's direction descends.
    fn squares(&self, at: &Unknowns, here: &Here, eps: f64) -> f64 {
        self.residual(at, here, eps, |sum, residual| sum + residual * residual)
    }

    /// Mean and least of all complementary products.
    fn complementarity(&self, at: &Unknowns) -> (f64, f64) {
        let (mut sum, mut least, mut count) = (0.0, f64::INFINITY, 0_u32);
        let mut add = |product: f64| {
            sum += product;
            least = f64::min(least, product);
            count += 1;
        };
        for j in 0..at.w.len() {
            add(at.xi[j] * (at.w[j] - self.alpha[j]));
            add(at.eta[j] * (self.beta[j] - at.w[j]));
        }
        for i in 0..at.y.len() {
            add(at.mu[i] * at.y[i]);
            add(at.lambda[i] * at.s[i]);
        }
        (sum / f64::from(count.max(1)), least)
    }

    /// The fast way, and where it creeps (no point of the box satisfies the rows), the careful one.
    fn run(&self) -> Unknowns {
        if self.free.is_empty() {
            return self.start();
        }
        let (at, good) = self.follow(self.start(), None);
        if good {
            return at;
        }
        self.follow(self.careful_start(), Some(1.0)).0
    }

    /// Newton's method from a start. The relaxation is a share of the present complementarity, or (`scheduled`) a value that
    /// falls by ten whenever the conditions relaxed by it are met.
    fn follow(&self, mut at: Unknowns, mut scheduled: Option<f64>) -> (Unknowns, bool) {
        let mut here = self.here(&at);
        let mut centring = 0.3;
        let most = if scheduled.is_some() {
            MOST_CAREFUL
        } else {
            MOST_FAST
        };
        let mut good = false;
        for _ in 0..most {
            let (complementarity, least) = self.complementarity(&at);
            if complementarity < GOOD_RELAXATION && self.largest(&at, &here, 0.0) < GOOD_RESIDUAL {
                good = true;
                break;
            }
            if least < OFF_CENTRE * complementarity {
                centring = 1.0;
            }
            let eps = if let Some(eps) = &mut scheduled {
                if self.largest(&at, &here, *eps) < 0.9 * *eps {
                    *eps *= 0.1;
                }
                *eps
            } else {
                centring * complementarity
            };
            let change = self.direction(&at, &here, eps.max(0.1 * GOOD_RELAXATION));
            let before = self.squares(&at, &here, eps);
            let mut length = self.longest(&at, &change);
            let mut moved = false;
            for _ in 0..MOST_HALVINGS {
                let next = at.plus(length, &change);
                let there = self.here(&next);
                if self.squares(&next, &there, eps) < before {
                    (at, here) = (next, there);
                    moved = true;
                    break;
                }
                length *= 0.5;
            }
            centring = match length {
                0.9.. => 0.1,
                0.5..0.9 => 0.3,
                0.1..0.5 => 0.6,
                _ => 1.0,
            };
            if !moved {
                // No step lowers the residual: rounding is all that is left of it.
                good = complementarity < 1e3 * GOOD_RELAXATION;
                break;
            }
        }
        (at, good)
    }

    /// Newton's step.
    fn direction(&self, at: &Unknowns, here: &Here, eps: f64) -> Unknowns {
        let (n, m) = (at.w.len(), at.y.len());
        let mut dx = vec![0.0; n];
        let mut diagonal_x = vec![0.0; n];
        for j in 0..n {
            let (low, high) = (at.w[j] - self.alpha[j], self.beta[j] - at.w[j]);
            dx[j] = here.first[j] - eps / low + eps / high;
            diagonal_x[j] = here.second[j] + at.xi[j] / low + at.eta[j] / high;
        }
        let (mut dy, mut diagonal_y) = (vec![0.0; m], vec![0.0; m]);
        let (mut dl, mut diagonal_l) = (vec![0.0; m], vec![0.0; m]);
        for i in 0..m {
            dy[i] = ELASTIC + at.y[i] - at.lambda[i] - eps / at.y[i];
            diagonal_y[i] = 1.0 + at.mu[i] / at.y[i];
            dl[i] = here.values[i] - at.y[i] + eps / at.lambda[i] + dy[i] / diagonal_y[i];
            diagonal_l[i] = at.s[i] / at.lambda[i] + 1.0 / diagonal_y[i];
        }
        let jacobian: Vec<Vec<(usize, f64)>> = self
            .rows
            .iter()
            .map(|&row| {
                let function = &self.sub.model.functions[row];
                let slopes = function.slopes.iter();
                slopes
                    .filter_map(|&(j, g)| {
                        let place = self.place[j]?;
                        Some((place, function.part(&here.terms[place], g, 1)))
                    })
                    .collect()
            })
            .collect();
        let rho: Vec<f64> = self.rows.iter().map(|&row| self.sub.rho[row]).collect();
        let even: Vec<f64> = here.terms.iter().map(|t| t.rho(1)).collect();
        let (w, lambda) = newton::solve(&System {
            jacobian: &jacobian,
            rho: &rho,
            even: &even,
            diagonal_x: &diagonal_x,
            diagonal_l: &diagonal_l,
            dx: &dx,
            dl: &dl,
        });
        let side =
            |positive: f64, room: f64, change: f64| (eps - positive * change) / room - positive;
        Unknowns {
            y: (0..m)
                .map(|i| (lambda[i] - dy[i]) / diagonal_y[i])
                .collect(),
            mu: (0..m)
                .map(|i| side(at.mu[i], at.y[i], (lambda[i] - dy[i]) / diagonal_y[i]))
                .collect(),
            s: (0..m)
                .map(|i| side(at.s[i], at.lambda[i], lambda[i]))
                .collect(),
            xi: (0..n)
                .map(|j| side(at.xi[j], at.w[j] - self.alpha[j], w[j]))
                .collect(),
            eta: (0..n)
                .map(|j| side(at.eta[j], self.beta[j] - at.w[j], -w[j]))
                .collect(),
            w,
            lambda,
        }
    }

    /// How far all that must be positive stays so, at most 1.
    fn longest(&self, at: &Unknowns, change: &Unknowns) -> f64 {
        let mut longest: f64 = 1.0;
        let mut limit = |value: f64, change: f64| {
            if change < 0.0 {
                longest = longest.min(-TO_BOUNDARY * value / change);
            }
        };
        for j in 0..at.w.len() {
            limit(at.w[j] - self.alpha[j], change.w[j]);
            limit(self.beta[j] - at.w[j], -change.w[j]);
            limit(at.xi[j], change.xi[j]);
            limit(at.eta[j], change.eta[j]);
        }
        for i in 0..at.y.len() {
            limit(at.y[i], change.y[i]);
            limit(at.lambda[i], change.lambda[i]);
            limit(at.s[i], change.s[i]);
            limit(at.mu[i], change.mu[i]);
        }
        longest
    }
}

impl Unknowns {
    fn plus(&self, length: f64, change: &Self) -> Self {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + length * b).collect();
        Self {
            w: sum(&self.w, &change.w),
            y: sum(&self.y, &change.y),
            lambda: sum(&self.lambda, &change.lambda),
            s: sum(&self.s, &change.s),
            mu: sum(&self.mu, &change.mu),
            xi: sum(&self.xi, &change.xi),
            eta: sum(&self.eta, &change.eta),
        }
    }
}
