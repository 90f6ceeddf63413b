//! The elimination tree of supernodes, prepared for the numeric phase: where each entry of the matrix and each update goes.
//!
//! A supernode eliminates `columns` unknowns of consecutive places in the elimination order; below them its columns have the
//! entries `pattern`. Its front is the dense lower triangle of both. The eliminated columns of a front, the panel, become
//! columns of the factor; the rest, the update, is added to the front of the parent. Panels and updates are padded to
//! multiples of four, padded columns with a unit diagonal, so that the kernels meet no remainders.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// A supernode.
#[derive(Clone, Debug)]
pub(super) struct Supernode {
    /// Place of its first column in the elimination order.
    pub start: usize,
    /// Eliminated columns.
    pub columns: usize,
    /// The same, padded.
    pub width: usize,
    /// Its part of [`Tree::pattern`].
    pub pattern: (usize, usize),
    /// Rows of the update, padded.
    pub height: usize,
    /// Start of its panel, column by column, `width + height` rows.
    pub panel: usize,
    /// Start of its update on the stack, column by column, `height` rows.
    pub update: usize,
    /// Its part of [`Tree::entries`].
    pub entries: (usize, usize),
    /// Its part of [`Tree::children`].
    pub children: (usize, usize),
    /// Its part of [`Tree::runs`].
    pub runs: (usize, usize),
    /// Rows of its pattern that the parent eliminates.
    pub eliminated_next: usize,
}

impl Supernode {
    /// Rows of a panel.
    pub fn rows(&self) -> usize {
        self.width + self.height
    }
}

/// Rows of an update that are neighbours in the parent's front as well.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// First row of the update.
    pub from: usize,
    /// Rows.
    pub len: usize,
    /// First row of the parent's front.
    pub to: usize,
}

/// Supernodes, children before their parents.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub nodes: Vec<Supernode>,
    /// Places in the elimination order.
    pub pattern: Vec<u32>,
    /// (slot in the matrix, place in the panel).
    pub entries: Vec<(u32, u32)>,
    /// Numbers of supernodes.
    pub children: Vec<u32>,
    pub runs: Vec<Run>,
    /// Numbers that all panels hold.
    pub panels: usize,
    /// Numbers that the stack of updates holds at most.
    pub stack: usize,
}

fn padded(n: usize) -> usize {
    n.next_multiple_of(4)
}

impl Tree {
    /// From faer's analysis of the lower triangle in compressed columns; `place[v]` is the place of unknown v.
    pub fn new(
        symbolic: &SymbolicSupernodalCholesky<u32>,
        column_start: &[u32],
        row: &[u32],
        place: &[u32],
    ) -> Self {
        let count = symbolic.n_supernodes();
        let begin = |s: usize| symbolic.supernode_begin()[s] as usize;
        let end = |s: usize| symbolic.supernode_end()[s] as usize;
        let pattern_of = |s: usize| symbolic.supernode(s).pattern();
        let mut owner = vec![0_u32; symbolic.nrows()];
        for s in 0..count {
            owner[begin(s)..end(s)].fill(s as u32);
        }
        let parent: Vec<Option<usize>> = (0..count)
            .map(|s| pattern_of(s).first().map(|r| owner[*r as usize] as usize))
            .collect();
        let order = postorder(&parent);
        let mut number = vec![0_u32; count];
        for (k, &s) in order.iter().enumerate() {
            number[s] = k as u32;
        }
        let mut this = Self::default();
        for &s in &order {
            let pattern = pattern_of(s);
            let first = this.pattern.len();
            this.pattern.extend_from_slice(pattern);
            let (width, height) = (padded(end(s) - begin(s)), padded(pattern.len()));
            this.nodes.push(Supernode {
                start: begin(s),
                columns: end(s) - begin(s),
                width,
                pattern: (first, this.pattern.len()),
                height,
                panel: this.panels,
                update: 0,
                entries: (0, 0),
                children: (0, 0),
                runs: (0, 0),
                eliminated_next: 0,
            });
            this.panels += width * (width + height);
        }
        let parent: Vec<Option<usize>> = order
            .iter()
            .map(|&s| parent[s].map(|p| number[p] as usize))
            .collect();
        let owner: Vec<u32> = owner.iter().map(|&s| number[s as usize]).collect();
        let mut front_row = vec![0; place.len()];
        this.link(&parent, &mut front_row);
        this.place_entries([column_start, row], place, &owner, &mut front_row);
        this.place_updates();
        this
    }

    /// Writes the rows of a supernode's front where its places are.
    fn number_front(&self, s: usize, front_row: &mut [u32]) {
        let node = &self.nodes[s];
        for (k, row) in front_row[node.start..node.start + node.columns]
            .iter_mut()
            .enumerate()
        {
            *row = k as u32;
        }
        let pattern = &self.pattern[node.pattern.0..node.pattern.1];
        for (k, &place) in pattern.iter().enumerate() {
            front_row[place as usize] = (node.width + k) as u32;
        }
    }

    fn link(&mut self, parent: &[Option<usize>], front_row: &mut [u32]) {
        let (starts, children) = by_owner(
            self.nodes.len(),
            parent
                .iter()
                .enumerate()
                .filter_map(|(s, p)| Some(((*p)?, s as u32))),
        );
        self.children = children;
        for p in 0..self.nodes.len() {
            self.number_front(p, front_row);
            let end = self.nodes[p].start + self.nodes[p].columns;
            self.nodes[p].children = (starts[p], starts[p + 1]);
            for k in starts[p]..starts[p + 1] {
                let s = self.children[k] as usize;
                let (first, last) = self.nodes[s].pattern;
                let next = self.pattern[first..last].partition_point(|r| (*r as usize) < end);
                let runs = self.runs.len();
                for i in 0..last - first {
                    let to = front_row[self.pattern[first + i] as usize] as usize;
                    match self.runs[runs..].last_mut() {
                        Some(run) if run.to + run.len == to && i != next => run.len += 1,
                        _ => self.runs.push(Run {
                            from: i,
                            len: 1,
                            to,
                        }),
                    }
                }
                self.nodes[s].eliminated_next = next;
                self.nodes[s].runs = (runs, self.runs.len());
            }
        }
    }

    fn place_entries(
        &mut self,
        matrix: [&[u32]; 2],
        place: &[u32],
        owner: &[u32],
        front_row: &mut [u32],
    ) {
        let [column_start, row] = matrix;
        let entries = (0..place.len()).flat_map(|column| {
            (column_start[column]..column_start[column + 1]).map(move |slot| {
                let (a, b) = (place[column], place[row[slot as usize] as usize]);
                (slot, a.min(b), a.max(b))
            })
        });
        let owned = entries.map(|e| (owner[e.1 as usize] as usize, e));
        let (starts, sorted) = by_owner(self.nodes.len(), owned);
        self.entries.reserve(sorted.len());
        for s in 0..self.nodes.len() {
            self.number_front(s, front_row);
            let node = &mut self.nodes[s];
            node.entries = (starts[s], starts[s + 1]);
            for &(slot, column, row) in &sorted[node.entries.0..node.entries.1] {
                let at = (column as usize - node.start) * node.rows();
                let at = at as u32 + front_row[row as usize];
                self.entries.push((slot, at));
            }
        }
    }

    /// Gives each update a place on the stack, from which the parent's elimination takes it.
    fn place_updates(&mut self) {
        let mut free: Vec<(usize, usize)> = Vec::new();
        for s in 0..self.nodes.len() {
            let need = self.nodes[s].height * self.nodes[s].height;
            let fit = free.iter().position(|(from, to)| to - from >= need);
            self.nodes[s].update = if let Some(k) = fit {
                let at = free[k].0;
                free[k].0 += need;
                at
            } else {
                let at = match free.last() {
                    Some(&(from, to)) if to == self.stack => {
                        free.pop();
                        from
                    }
                    _ => self.stack,
                };
                self.stack = at + need;
                at
            };
            let (first, last) = self.nodes[s].children;
            for k in first..last {
                let child = &self.nodes[self.children[k] as usize];
                free.push((child.update, child.update + child.height * child.height));
            }
            free.sort_unstable();
            free.dedup_by(|next, kept| {
                let joins = next.0 == kept.1;
                if joins {
                    kept.1 = next.1;
                }
                joins
            });
            free.retain(|(from, to)| from < to);
        }
    }
}

/// Sorts what has an owner by it; where each owner's begin.
fn by_owner<T: Copy>(
    owners: usize,
    owned: impl Iterator<Item = (usize, T)> + Clone,
) -> (Vec<usize>, Vec<T>) {
    let mut starts = vec![0; owners + 1];
    owned.clone().for_each(|(owner, _)| starts[owner + 1] += 1);
    for k in 0..owners {
        starts[k + 1] += starts[k];
    }
    let Some((_, any)) = owned.clone().next() else {
        return (starts, Vec::new());
    };
    let mut sorted = vec![any; starts[owners]];
    let mut next = starts.clone();
    for (owner, thing) in owned {
        sorted[next[owner]] = thing;
        next[owner] += 1;
    }
    (starts, sorted)
}

/// Numbers children before their parents, the children of one parent after each other.
fn postorder(parent: &[Option<usize>]) -> Vec<usize> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); parent.len()];
    let mut stack: Vec<(usize, bool)> = Vec::new();
    for (s, p) in parent.iter().enumerate() {
        match p {
            Some(p) => children[*p].push(s),
            None => stack.push((s, false)),
        }
    }
    let mut order = Vec::with_capacity(parent.len());
    while let Some((s, seen)) = stack.pop() {
        if seen {
            order.push(s);
        } else {
            stack.push((s, true));
            stack.extend(children[s].iter().map(|&c| (c, false)));
        }
    }
    order
}
