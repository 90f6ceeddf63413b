//! Profiles of several methods over a set of problems.

/// What a method needed on a problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// The problem.
    pub problem: String,
    /// The method.
    pub method: String,
    /// Number of its variables.
    pub variables: usize,
    /// Analyses to the target; `None` where it was not reached.
    pub cost: Option<f64>,
}

/// The share of problems that a method has solved, as a staircase.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The method.
    pub method: String,
    /// (k, share of the problems that are solved within k) where the share grows.
    pub steps: Vec<(f64, f64)>,
}

/// Profiles of all methods that a table names, in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct Profiles {
    /// Number of problems.
    pub problems: usize,
    /// k counts (n + 1) analyses, those of one gradient by differences (More and Wild 2009).
    pub data: Vec<Profile>,
    /// k is the cost over that of the cheapest method on the problem (Dolan and More 2002).
    pub performance: Vec<Profile>,
}

/// The value from which a problem counts as solved: a share 1 - `tolerance` of the possible gain is made (More and Wild's
/// f(x0) - f(x) >= (1 - tau) (f(x0) - f_L)).
pub fn profile_target(first: f64, best: f64, tolerance: f64) -> f64 {
    best + tolerance * (first - best)
}

impl Profiles {
    /// Of a table. A method that lacks a line for a problem has not solved it.
    pub fn of(table: &[Solved]) -> Self {
        let problems = distinct(table.iter().map(|s| s.problem.as_str()));
        let methods = distinct(table.iter().map(|s| s.method.as_str()));
        let cheapest = |problem: &str| {
            let costs = table.iter().filter(|s| s.problem == problem);
            costs.filter_map(|s| s.cost).reduce(f64::min)
        };
        let profile = |method: &&str, measure: &dyn Fn(&Solved, f64) -> f64| {
            let lines = table.iter().filter(|s| s.method == *method);
            let at: Vec<f64> = lines.filter_map(|s| Some(measure(s, s.cost?))).collect();
            Profile {
                method: (*method).to_owned(),
                steps: staircase(at, problems.len()),
            }
        };
        let in_gradients = |s: &Solved, cost: f64| cost / (s.variables + 1) as f64;
        let in_cheapest = |s: &Solved, cost: f64| cost / cheapest(&s.problem).unwrap_or(cost);
        Self {
            problems: problems.len(),
            data: methods.iter().map(|m| profile(m, &in_gradients)).collect(),
            performance: methods.iter().map(|m| profile(m, &in_cheapest)).collect(),
        }
    }

    /// Both profiles as CSV.
    pub fn csv(&self) -> String {
        let mut text = String::from("profile,method,k,share\n");
        for (name, profiles) in [("data", &self.data), ("performance", &self.performance)] {
            for profile in profiles {
                for (k, share) in &profile.steps {
                    text += &format!("{name},{},{k},{share}\n", profile.method);
                }
            }
        }
        text
    }
}

impl Profile {
    /// Share of the problems that are solved within k.
    pub fn share(&self, k: f64) -> f64 {
        let within = self.steps.partition_point(|step| step.0 <= k);
        self.steps[..within].last().map_or(0.0, |step| step.1)
    }
}

fn staircase(mut at: Vec<f64>, problems: usize) -> Vec<(f64, f64)> {
    at.sort_by(f64::total_cmp);
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for (solved, k) in at.into_iter().enumerate() {
        let share = (solved + 1) as f64 / problems as f64;
        match steps.last_mut() {
            Some(last) if last.0 == k => last.1 = share,
            _ => steps.push((k, share)),
        }
    }
    steps
}

/// In order of appearance.
fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_by_hand() {
        let line = |problem: &str, method: &str, variables, cost| Solved {
            problem: problem.into(),
            method: method.into(),
            variables,
            cost,
        };
        let table = [
            line("one", "a", 1, Some(4.0)),
            line("one", "b", 1, Some(8.0)),
            line("nine", "a", 9, Some(100.0)),
            line("nine", "b", 9, Some(20.0)),
            line("hard", "a", 3, None),
            line("hard", "b", 3, Some(40.0)),
            line("hopeless", "a", 3, None),
        ];
        let found = Profiles::of(&table);
        assert_eq!(found.problems, 4);
        assert_eq!(found.data[0].steps, [(2.0, 0.25), (10.0, 0.5)]);
        assert_eq!(found.data[1].steps, [(2.0, 0.25), (4.0, 0.5), (10.0, 0.75)]);
        assert_eq!(found.performance[0].steps, [(1.0, 0.25), (5.0, 0.5)]);
        assert_eq!(found.performance[1].steps, [(1.0, 0.5), (2.0, 0.75)]);
        let b = &found.performance[1];
        assert_eq!((b.share(0.9), b.share(1.5), b.share(1e9)), (0.0, 0.5, 0.75));
        assert_eq!(found.csv().lines().count(), 10);
        assert_eq!(profile_target(10.0, 2.0, 0.1), 2.8);
        assert_eq!(Profiles::of(&[]).problems, 0);
    }
}
