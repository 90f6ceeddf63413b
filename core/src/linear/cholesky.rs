//! Supernodal Cholesky factorisation, with a symmetric indefinite one (faer) for the count of negative pivots.

use faer::Par;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::lblt::factor::LbltParams;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Side, Spec};

use super::extension::{Coupling, Extension};
use super::multifrontal::Multifrontal;
use super::supernodes::Tree;

/// Merging of small supernodes: up to so many columns, and so large a part of zeros.
const RELAX: [(usize, f64); 4] = [(4, 1.0), (16, 0.4), (48, 0.15), (usize::MAX, 0.05)];

/// Right-hand sides that are solved together.
const MOST_COLUMNS: usize = 4;

/// The symbolic analysis failed (out of memory, index overflow).
#[derive(Clone, Debug, thiserror::Error)]
#[error("failed to analyse a system of {unknowns} unknowns: {detail}")]
pub struct AnalysisFailed {
    /// Number of unknowns.
    pub unknowns: usize,
    /// The library's own words.
    pub detail: String,
}

/// What the last factorisation was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Factor {
    /// None yet.
    None,
    /// L L', positive definite.
    Cholesky,
    /// L B L' with this many negative eigenvalues.
    Indefinite {
        /// Negative pivots.
        negative: usize,
    },
}

/// One topology: its symbolic analysis and the storage of one factor.
pub struct Solver {
    symbolic: SymbolicCholesky<u32>,
    /// Unknown at each place of the elimination order.
    order: Vec<u32>,
    column_start: Vec<u32>,
    row: Vec<u32>,
    definite: Multifrontal,
    /// Made where a matrix is indefinite for the first time.
    indefinite: Option<Indefinite>,
    factor: Factor,
    /// Factorisations so far.
    pub factorisations: usize,
    /// Couplings outside of the pattern that was given; then `column_start` and `row` have their places too.
    extension: Option<Extension>,
    /// Why an extension could not be analysed; factors leave its couplings out from then on.
    pub failed_extension: Option<AnalysisFailed>,
}

/// Storage of an L B L' factor.
struct Indefinite {
    values: Vec<f64>,
    subdiagonal: Vec<f64>,
    pivot_order: [Vec<u32>; 2],
    scratch: MemBuffer,
}

impl Solver {
    /// Analyses the lower triangle given in compressed columns; `order[k]` is the unknown eliminated k-th.
    pub fn new(column_start: &[u32], row: &[u32], order: &[u32]) -> Result<Self, AnalysisFailed> {
        let n = order.len();
        let failed = |detail: String| AnalysisFailed {
            unknowns: n,
            detail,
        };
        let mut inverse = vec![0_u32; n];
        for (k, &v) in order.iter().enumerate() {
            inverse[v as usize] = k as u32;
        }
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, column_start, None, row);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, n)),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                supernodal_params: SymbolicSupernodalParams {
                    relax: Some(&RELAX),
                },
                ..Default::default()
            },
        )
        .map_err(|e| failed(format!("{e:?}")))?;
        let (order, place) = symbolic.perm().map_or_else(
            || (order.to_vec(), inverse),
            |perm| (perm.arrays().0.to_vec(), perm.arrays().1.to_vec()),
        );
        let SymbolicCholeskyRaw::Supernodal(super_nodes) = symbolic.raw() else {
            return Err(failed("no supernodes".to_owned()));
        };
        let tree = Tree::new(super_nodes, column_start, row, &place);
        Ok(Self {
            definite: Multifrontal::new(tree, n),
            indefinite: None,
            order,
            column_start: column_start.to_vec(),
            row: row.to_vec(),
            symbolic,
            factor: Factor::None,
            factorisations: 0,
            extension: None,
            failed_extension: None,
        })
    }

    /// Whether the analysis has places for all of these couplings that act.
    pub fn covers(&self, couplings: &[Coupling]) -> bool {
        match &self.extension {
            Some(extension) => extension.covers(couplings),
            None => couplings.iter().all(|c| c.values.is_none()),
        }
    }

    /// Analyses a pattern anew with places for these couplings beside its own.
    pub fn extend(
        &mut self,
        column_start: &[u32],
        row: &[u32],
        couplings: &[Coupling],
        order: &[u32],
    ) {
        let extension = Extension::new(column_start, row, couplings);
        match Self::new(&extension.column_start, &extension.row, order) {
            Ok(solver) => {
                *self = Self {
                    extension: Some(extension),
                    factorisations: self.factorisations,
                    ..solver
                };
            }
            Err(why) => self.failed_extension = Some(why),
        }
    }

    /// The values of the couplings in the factorisations that follow.
    pub fn set_couplings(&mut self, couplings: &[Coupling]) {
        if let Some(extension) = &mut self.extension {
            extension.set(couplings);
        }
    }

    /// Unknowns.
    pub fn size(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Numbers that a factor holds.
    pub fn len_values(&self) -> usize {
        self.symbolic.len_val()
    }

    /// The factor that `solve` uses.
    pub fn factor(&self) -> Factor {
        self.factor
    }

    /// Factorises a positive definite matrix; `false` if it is not.
    pub fn factorise(&mut self, values: &[f64]) -> bool {
        self.factorisations += 1;
        let values = match &mut self.extension {
            None => values,
            Some(extension) => extension.merged(values),
        };
        let definite = self.definite.factorise(values);
        self.factor = if definite {
            Factor::Cholesky
        } else {
            Factor::None
        };
        definite
    }

    /// Factorises a symmetric matrix of any inertia and counts its negative pivots.
    pub fn factorise_indefinite(&mut self, values: &[f64]) -> usize {
        self.factorisations += 1;
        let values = match &mut self.extension {
            None => values,
            Some(extension) => extension.merged(values),
        };
        let n = self.symbolic.nrows();
        let symbolic = &self.symbolic;
        let storage = self.indefinite.get_or_insert_with(|| {
            let need = symbolic
                .factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default())
                .or(symbolic.solve_in_place_scratch::<f64>(MOST_COLUMNS, Par::Seq));
            Indefinite {
                values: vec![0.0; symbolic.len_val()],
                subdiagonal: vec![0.0; n],
                pivot_order: [vec![0; n], vec![0; n]],
                scratch: MemBuffer::new(need),
            }
        });
        let [forward, inverse] = &mut storage.pivot_order;
        // The pattern was checked at construction.
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row);
        symbolic.factorize_numeric_intranode_lblt(
            &mut storage.values,
            &mut storage.subdiagonal,
            forward,
            inverse,
            SparseColMatRef::new(pattern, values),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut storage.scratch),
            Spec::<LbltParams, f64>::default(),
        );
        let negative = self.count_negative();
        self.factor = Factor::Indefinite { negative };
        negative
    }

    /// A 2 x 2 pivot of the Bunch-Kaufman strategy has one eigenvalue of each sign.
    fn count_negative(&self) -> usize {
        let SymbolicCholeskyRaw::Supernodal(super_nodes) = self.symbolic.raw() else {
            return 0;
        };
        let Some(storage) = &self.indefinite else {
            return 0;
        };
        let mut negative = 0;
        let begin = super_nodes.supernode_begin();
        for s in 0..super_nodes.n_supernodes() {
            let (start, end) = (begin[s] as usize, super_nodes.supernode_end()[s] as usize);
            let rows = (super_nodes.col_ptr_for_val()[s + 1] - super_nodes.col_ptr_for_val()[s])
                as usize
                / (end - start);
            let first = super_nodes.col_ptr_for_val()[s] as usize;
            let mut k = 0;
            while k < end - start {
                if storage.subdiagonal[start + k] == 0.0 {
                    negative += usize::from(storage.values[first + k * rows + k] < 0.0);
                    k += 1;
                } else {
                    negative += 1;
                    k += 2;
                }
            }
        }
        negative
    }

    /// Solves in place for `columns` right-hand sides, stored one after the other.
    pub fn solve(&mut self, rhs: &mut [f64], columns: usize) {
        let n = self.symbolic.nrows();
        let rhs = &mut rhs[..n * columns];
        match (self.factor, &mut self.indefinite) {
            (Factor::Cholesky, _) => self.definite.solve(rhs, &self.order),
            (Factor::Indefinite { .. }, Some(storage)) => {
                let [forward, inverse] = &storage.pivot_order;
                for part in rhs.chunks_mut(n * MOST_COLUMNS) {
                    let order = PermRef::new_checked(forward, inverse, n);
                    let (values, subdiagonal) = (&storage.values, &storage.subdiagonal);
                    IntranodeLbltRef::new(&self.symbolic, values, subdiagonal, order)
                        .solve_in_place_with_conj(
                            Conj::No,
                            MatMut::from_column_major_slice_mut(part, n, part.len() / n),
                            Par::Seq,
                            MemStack::new(&mut storage.scratch),
                        );
                }
            }
            // Without a factor there is no solution; the caller sees that nothing is finite.
            _ => rhs.fill(f64::NAN),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tridiagonal (-1, d, -1).
    fn tridiagonal(n: usize, d: f64) -> (Vec<u32>, Vec<u32>, Vec<f64>) {
        let (mut start, mut row, mut value) = (vec![0], Vec::new(), Vec::new());
        for k in 0..n as u32 {
            row.push(k);
            value.push(d);
            if k + 1 < n as u32 {
                row.push(k + 1);
                value.push(-1.0);
            }
            start.push(row.len() as u32);
        }
        (start, row, value)
    }

    #[test]
    fn inertia_and_solution_of_a_shifted_laplacian() {
        let n = 50;
        let order: Vec<u32> = (0..n as u32).rev().collect();
        for d in [2.5, 1.3, 0.1, -0.7] {
            let (start, row, value) = tridiagonal(n, d);
            let mut solver = Solver::new(&start, &row, &order).unwrap();
            // Eigenvalues d - 2 cos(k pi / (n + 1)).
            let exact = (1..=n)
                .filter(|k| d < 2.0 * (*k as f64 * std::f64::consts::PI / (n + 1) as f64).cos())
                .count();
            assert_eq!(solver.factorise(&value), exact == 0);
            assert_eq!(solver.factorise_indefinite(&value), exact, "d = {d}");
            let x: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
            let mut rhs: Vec<f64> = (0..n)
                .map(|k| {
                    d * x[k]
                        - if k > 0 { x[k - 1] } else { 0. }
                        - if k + 1 < n { x[k + 1] } else { 0. }
                })
                .collect();
            solver.solve(&mut rhs, 1);
            assert!(rhs.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-11));
        }
    }

    /// Unknowns on a grid of m x m nodes, each coupled to its eight neighbours as the elements of the grid do it.
    fn grid(m: u32, d: f64) -> (Vec<u32>, Vec<u32>, Vec<f64>, Vec<u32>) {
        let (mut start, mut row, mut value) = (vec![0], Vec::new(), Vec::new());
        for v in 0..m * m {
            for w in v..m * m {
                let (dx, dy) = ((v % m).abs_diff(w % m), v / m == w / m);
                let near = dx <= 1 && (w / m) - (v / m) <= 1;
                if near {
                    row.push(w);
                    let coupling = if dx == 0 || dy { -1.0 } else { -0.25 };
                    value.push(if v == w { d } else { coupling });
                }
            }
            start.push(row.len() as u32);
        }
        let at = |i: u32, j: u32| j * m + i;
        let quads: Vec<[u32; 4]> = (0..(m - 1) * (m - 1))
            .map(|k| (k % (m - 1), k / (m - 1)))
            .map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
            .collect();
        let centroid = quads
            .iter()
            .map(|q| [f64::from(q[0] % m), f64::from(q[0] / m)])
            .collect();
        let elements = crate::linear::Elements {
            nodes: quads.iter().map(<[u32; 4]>::as_slice).collect(),
            centroid,
        };
        let order = crate::linear::nested_dissection(&elements, (m * m) as usize);
        (start, row, value, order)
    }

    #[test]
    fn both_factors_solve_on_grids_of_all_sizes() {
        for m in [2, 3, 7, 12, 25] {
            let (start, row, value, order) = grid(m, 5.5);
            let n = order.len();
            let mut solver = Solver::new(&start, &row, &order).unwrap();
            let x: Vec<f64> = (0..2 * n).map(|k| (k as f64).sin()).collect();
            let mut product = vec![0.0; 2 * n];
            for c in 0..n {
                for k in start[c] as usize..start[c + 1] as usize {
                    let r = row[k] as usize;
                    for part in [0, n] {
                        product[part + r] += value[k] * x[part + c];
                        if r != c {
                            product[part + c] += value[k] * x[part + r];
                        }
                    }
                }
            }
            assert!(solver.factorise(&value), "m = {m}");
            let mut one = product.clone();
            solver.solve(&mut one, 2);
            assert_eq!(solver.factorise_indefinite(&value), 0);
            let mut other = product;
            solver.solve(&mut other, 2);
            for solution in [one, other] {
                assert!(
                    solution.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12),
                    "m = {m}"
                );
            }
            // The sums of the rows are negative: not positive definite.
            let (.., value, _) = grid(m.max(7), 1.0);
            let (start, row, _, order) = grid(m.max(7), 1.0);
            let mut solver = Solver::new(&start, &row, &order).unwrap();
            assert!(!solver.factorise(&value));
            assert!(solver.factorise_indefinite(&value) > 0);
        }
    }
}
