//! Supernodal Cholesky factorisation (faer), with a symmetric indefinite one for the count of negative pivots.

use faer::Par;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::lblt::factor::LbltParams;
use faer::linalg::cholesky::llt::factor::{LltParams, LltRegularization};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Side, Spec};

/// Merging of small supernodes; faer's own choice is 3-4 times slow on systems of this size.
const RELAX: [(usize, f64); 4] = [(8, 1.0), (32, 0.8), (96, 0.2), (usize::MAX, 0.08)];

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
    column_start: Vec<u32>,
    row: Vec<u32>,
    values: Vec<f64>,
    subdiagonal: Vec<f64>,
    pivot_order: [Vec<u32>; 2],
    scratch: MemBuffer,
    factor: Factor,
    /// Factorisations so far.
    pub factorisations: usize,
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
        let need = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default())
            .or(symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default()))
            .or(symbolic.solve_in_place_scratch::<f64>(MOST_COLUMNS, Par::Seq));
        let scratch = MemBuffer::try_new(need).map_err(|_| failed("out of memory".to_owned()))?;
        Ok(Self {
            values: vec![0.0; symbolic.len_val()],
            subdiagonal: vec![0.0; n],
            pivot_order: [vec![0; n], vec![0; n]],
            column_start: column_start.to_vec(),
            row: row.to_vec(),
            symbolic,
            scratch,
            factor: Factor::None,
            factorisations: 0,
        })
    }

    /// Unknowns.
    pub fn size(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Numbers that a factor holds.
    pub fn len_values(&self) -> usize {
        self.values.len()
    }

    /// The factor that `solve` uses.
    pub fn factor(&self) -> Factor {
        self.factor
    }

    fn matrix<'a>(
        column_start: &'a [u32],
        row: &'a [u32],
        values: &'a [f64],
        n: usize,
    ) -> SparseColMatRef<'a, u32, f64> {
        // The pattern was checked at construction.
        SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, column_start, None, row),
            values,
        )
    }

    /// Factorises a positive definite matrix; `false` if it is not.
    pub fn factorise(&mut self, values: &[f64]) -> bool {
        self.factorisations += 1;
        let n = self.symbolic.nrows();
        let result = self.symbolic.factorize_numeric_llt(
            &mut self.values,
            Self::matrix(&self.column_start, &self.row, values, n),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Spec::<LltParams, f64>::default(),
        );
        self.factor = if result.is_ok() {
            Factor::Cholesky
        } else {
            Factor::None
        };
        result.is_ok()
    }

    /// Factorises a symmetric matrix of any inertia and counts its negative pivots.
    pub fn factorise_indefinite(&mut self, values: &[f64]) -> usize {
        self.factorisations += 1;
        let n = self.symbolic.nrows();
        let [forward, inverse] = &mut self.pivot_order;
        self.symbolic.factorize_numeric_intranode_lblt(
            &mut self.values,
            &mut self.subdiagonal,
            forward,
            inverse,
            Self::matrix(&self.column_start, &self.row, values, n),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.scratch),
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
                if self.subdiagonal[start + k] == 0.0 {
                    negative += usize::from(self.values[first + k * rows + k] < 0.0);
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
        for part in rhs[..n * columns].chunks_mut(n * MOST_COLUMNS) {
            self.solve_together(part);
        }
    }

    fn solve_together(&mut self, rhs: &mut [f64]) {
        let n = self.symbolic.nrows();
        let columns = rhs.len() / n;
        let rhs = MatMut::from_column_major_slice_mut(rhs, n, columns);
        let stack = MemStack::new(&mut self.scratch);
        match self.factor {
            Factor::None => {}
            Factor::Cholesky => {
                LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
                    Conj::No,
                    rhs,
                    Par::Seq,
                    stack,
                );
            }
            Factor::Indefinite { .. } => {
                let order = PermRef::new_checked(&self.pivot_order[0], &self.pivot_order[1], n);
                IntranodeLbltRef::new(&self.symbolic, &self.values, &self.subdiagonal, order)
                    .solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
            }
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
}
