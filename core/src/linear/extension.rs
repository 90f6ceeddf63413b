//! Couplings of a few unknowns that come and go, beside a pattern that stays.

use std::collections::BTreeMap;

/// A symmetric coupling of twelve unknowns, two for each of six nodes.
#[derive(Clone, Debug)]
pub struct Coupling {
    /// What couples.
    pub key: [u32; 2],
    /// Its nodes, for the order of elimination.
    pub nodes: [Option<u32>; 6],
    /// Its unknowns; [`Self::NONE`] where there is none.
    pub unknowns: [u32; 12],
    /// Its lower triangle; `None` for zero.
    pub values: Option<Box<[[f64; 12]; 12]>>,
}

impl Coupling {
    /// No unknown.
    pub const NONE: u32 = u32::MAX;

    /// The entries (a, b) of the lower triangle, a >= b, with their unknowns as (row, column). A node may come twice.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, u32, u32)> + '_ {
        (0..12).flat_map(move |a| {
            (0..=a).filter_map(move |b| {
                let (p, q) = (self.unknowns[a], self.unknowns[b]);
                (p != Self::NONE && q != Self::NONE).then(|| (a, b, p.max(q), p.min(q)))
            })
        })
    }
}

/// A pattern with the places of couplings.
pub(super) struct Extension {
    pub column_start: Vec<u32>,
    pub row: Vec<u32>,
    /// Place of each entry of the pattern that stays.
    from_base: Vec<u32>,
    /// Places of the entries of each coupling.
    places: BTreeMap<[u32; 2], Vec<u32>>,
    /// (place, value) of the present couplings.
    present: Vec<(u32, f64)>,
    values: Vec<f64>,
}

impl Extension {
    /// The union of a lower triangle in compressed columns with the entries of couplings.
    pub fn new(column_start: &[u32], row: &[u32], couplings: &[Coupling]) -> Self {
        let n = column_start.len() - 1;
        let mut extra: Vec<(u32, u32)> = couplings
            .iter()
            .flat_map(|c| c.entries().map(|(.., row, column)| (column, row)))
            .collect();
        extra.sort_unstable();
        extra.dedup();
        let mut this = Self {
            column_start: Vec::with_capacity(n + 1),
            row: Vec::with_capacity(row.len() + extra.len()),
            from_base: Vec::with_capacity(row.len()),
            places: BTreeMap::new(),
            present: Vec::new(),
            values: Vec::new(),
        };
        this.column_start.push(0);
        let mut extra = extra.into_iter().peekable();
        for column in 0..n {
            let own = &row[column_start[column] as usize..column_start[column + 1] as usize];
            for &r in own {
                while let Some(&(c, e)) = extra.peek()
                    && c as usize == column
                    && e <= r
                {
                    if e < r {
                        this.row.push(e);
                    }
                    extra.next();
                }
                this.from_base.push(this.row.len() as u32);
                this.row.push(r);
            }
            while let Some(&(c, e)) = extra.peek()
                && c as usize == column
            {
                this.row.push(e);
                extra.next();
            }
            this.column_start.push(this.row.len() as u32);
        }
        this.values = vec![0.0; this.row.len()];
        this.places = couplings
            .iter()
            .map(|c| {
                let places = c.entries().map(|(.., row, column)| this.place(row, column));
                (c.key, places.collect())
            })
            .collect();
        this
    }

    fn place(&self, row: u32, column: u32) -> u32 {
        let start = self.column_start[column as usize] as usize;
        let end = self.column_start[column as usize + 1] as usize;
        // Every entry of a coupling was put into the pattern.
        (start + self.row[start..end].partition_point(|r| *r < row)) as u32
    }

    /// Whether those that act have places: the others keep theirs where they have one, and get one with the next that acts.
    pub fn covers(&self, couplings: &[Coupling]) -> bool {
        let mut acting = couplings.iter().filter(|c| c.values.is_some());
        acting.all(|c| self.places.contains_key(&c.key))
    }

    /// Takes the values of the present couplings.
    pub fn set(&mut self, couplings: &[Coupling]) {
        self.present.clear();
        for coupling in couplings {
            if let (Some(values), Some(places)) = (&coupling.values, self.places.get(&coupling.key))
            {
                // Of an unknown that comes twice both mixed entries are on the diagonal.
                let times = |row: u32, column: u32, a: usize, b: usize| {
                    if row == column && a != b { 2.0 } else { 1.0 }
                };
                let values = coupling
                    .entries()
                    .map(|(a, b, row, column)| times(row, column, a, b) * values[a][b]);
                self.present.extend(places.iter().copied().zip(values));
            }
        }
    }

    /// The sum of values of the pattern that stays and of the couplings.
    pub fn merged(&mut self, base: &[f64]) -> &[f64] {
        self.values.fill(0.0);
        for (place, value) in self.from_base.iter().zip(base) {
            self.values[*place as usize] = *value;
        }
        for (place, value) in &self.present {
            self.values[*place as usize] += value;
        }
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Solver;

    #[test]
    fn a_coupled_chain_solves_as_its_dense_matrix() {
        // A chain of springs, and a coupling of its ends.
        let n = 20_u32;
        let (mut start, mut row, mut values) = (vec![0], Vec::new(), Vec::new());
        for k in 0..n {
            row.push(k);
            values.push(2.5);
            if k + 1 < n {
                row.push(k + 1);
                values.push(-1.0);
            }
            start.push(row.len() as u32);
        }
        let order: Vec<u32> = (0..n).collect();
        let mut solver = Solver::new(&start, &row, &order).unwrap();
        let mut unknowns = [Coupling::NONE; 12];
        (unknowns[0], unknowns[7]) = (n - 2, 1);
        let mut block = Box::new([[0.0; 12]; 12]);
        (block[0][0], block[7][0], block[7][7]) = (3.0, -3.0, 3.0);
        let coupling = Coupling {
            key: [0, 1],
            nodes: [None; 6],
            unknowns,
            values: Some(block),
        };
        let couplings = [coupling];
        assert!(!solver.covers(&couplings));
        solver.extend(&start, &row, &couplings, &order);
        assert!(solver.covers(&couplings));
        solver.set_couplings(&couplings);
        assert!(solver.factorise(&values));
        let x: Vec<f64> = (0..n).map(|k| f64::from(k).sin()).collect();
        let product = |k: usize, coupled: f64| {
            let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
            let mut sum = 2.5 * x[k] - at(k + 1) - if k > 0 { at(k - 1) } else { 0.0 };
            let (p, q) = (n as usize - 2, 1);
            if k == p {
                sum += coupled * (x[p] - x[q]);
            }
            if k == q {
                sum += coupled * (x[q] - x[p]);
            }
            sum
        };
        let mut rhs: Vec<f64> = (0..n as usize).map(|k| product(k, 3.0)).collect();
        solver.solve(&mut rhs, 1);
        assert!(rhs.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
        // Without the coupling its places hold zeros.
        solver.set_couplings(&[]);
        assert!(solver.factorise(&values));
        let mut rhs: Vec<f64> = (0..n as usize).map(|k| product(k, 0.0)).collect();
        solver.solve(&mut rhs, 1);
        assert!(rhs.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
