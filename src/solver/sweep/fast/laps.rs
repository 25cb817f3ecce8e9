//! Which samples of a sweep stand where in which lap of its mesh, and which teeth stand there (docs/explanation/theory.md sections 3 and 9).

use crate::mesh::{Mesh, Neighbours, Place, Samples};

/// A count that memory can hold, as an index; the caller has bounded the sweep.
pub(super) fn whole(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}

/// How the teeth at an input angle lie in a tile: all those at the places one after another, so many times. Of each time those first whose places are
/// whole multiples of `apart` from the first: neighbours in a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Teeth that are told apart at each place.
    pub(super) at_each_place: usize,
    /// How far the places of neighbours in a zone are apart.
    pub(super) apart: usize,
}

impl Layout {
    /// One tooth at each place, place by place.
    pub(super) const PLAIN: Self = Self { at_each_place: 1, apart: 1 };

    /// Where the tooth at a place, counted from 1, stands among `places`, the first of those told apart.
    pub(super) fn index(self, place: usize, places: usize) -> usize {
        let (before, residue) = ((place - 1) / self.apart, (place - 1) % self.apart);
        let of_residues_before = residue * (places / self.apart) + residue.min(places % self.apart);
        of_residues_before + before
    }
}

/// Teeth of a zone that stand side by side in a tile as they do in the answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Listed {
    /// The first of them in a row of the tile.
    pub(super) at: usize,
    /// Who they are.
    pub(super) teeth: Neighbours,
}

impl Listed {
    pub(super) fn count(&self) -> usize {
        whole(self.teeth.count)
    }

    /// Where one of them is among the items.
    pub(super) fn place(&self, mesh: &Mesh, tooth: usize) -> Place {
        mesh.place_of(&self.teeth, tooth as u64)
    }
}

/// The teeth of a lap.
#[derive(Debug, Default)]
pub(super) struct LapTeeth {
    runs: Vec<Neighbours>,
    /// In the order of the answer.
    pub(super) listed: Vec<Listed>,
    /// The same, lobe or not.
    pub(super) stretches: Vec<Stretch>,
}

/// Teeth of a row that stand side by side in the tile as they do in the answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    pub(super) at: usize,
    pub(super) count: usize,
}

impl LapTeeth {
    pub(super) fn list(&mut self, mesh: &Mesh, layout: Layout, places: usize, lap: u64) {
        mesh.list(places as u64, lap, &mut self.runs);
        let apart = mesh.laps_of_load_period();
        self.listed.clear();
        self.listed.extend(self.runs.iter().map(|&teeth| {
            // Lobes that are as many apart as these stand alike.
            let which = if layout.at_each_place > 1 { whole(teeth.lobe / apart) } else { 0 };
            Listed { at: which * places + layout.index(whole(teeth.first_place), places), teeth }
        }));
        self.stretches.clear();
        for listed in &self.listed {
            match self.stretches.last_mut() {
                Some(last) if last.at + last.count == listed.at => last.count += listed.count(),
                _ => self.stretches.push(Stretch { at: listed.at, count: listed.count() }),
            }
        }
    }
}

/// The laps of a sweep over equal intervals. Sample n, of N in a load period of L laps, stands where `n L = l N + f` with f below N: in lap l, f of its N parts on. With
/// `G = gcd(N, L)`, `S = N/G` and `q = L/G` that is `n q = l S + f/G`.
pub(super) struct Laps {
    mesh: Mesh,
    samples: Samples,
    /// `S`.
    pub(super) of_lap: Samples,
    /// `q`: samples of a lap are as many of its S parts apart.
    pub(super) stride: u64,
    count: u64,
    /// Where the teeth of all zones are listed, how many of them before each of S samples one after another, which stand at all of a lap's S parts, and of them all.
    before: Option<Vec<usize>>,
}

impl Laps {
    pub(super) fn new(mesh: &Mesh, samples: Samples) -> Self {
        let of_lap = mesh.samples_of_lap(samples);
        let stride = mesh.laps_of_load_period() * of_lap.count() / samples.count();
        let before = (!mesh.zones_are_alike()).then(|| {
            let one_zone = mesh.as_one_zone();
            let at_each_place = whole(mesh.listed_at_each_place());
            let mut before = 0;
            let listed = (0..of_lap.count()).map(|sample| {
                let fraction = sample * stride % of_lap.count();
                at_each_place * whole(*one_zone.teeth_at(fraction, of_lap).end())
            });
            let after_each = listed.map(|listed| {
                before += listed;
                before
            });
            std::iter::once(0).chain(after_each).collect()
        });
        Self { mesh: *mesh, samples, of_lap, stride, count: mesh.laps(), before }
    }

    /// The mesh of the sweep.
    pub(super) const fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Whether the teeth of all zones are listed.
    pub(super) const fn are_listed(&self) -> bool {
        self.before.is_some()
    }

    /// The laps of which a sample stands at this part; where teeth are listed also that which begins where the sweep ends.
    pub(super) fn with(&self, fraction: u64) -> impl Iterator<Item = u64> + use<> {
        let Self { stride, count, .. } = *self;
        let of_lap = self.of_lap.count();
        let first = (0..stride).find(|lap| (lap * of_lap + fraction).is_multiple_of(stride)).unwrap_or(count);
        let end = (fraction == 0 && self.are_listed()).then_some(count);
        (first..count).step_by(whole(stride)).chain(end)
    }

    /// Whether a lap begins where the sweep ends.
    pub(super) const fn is_end(&self, lap: u64) -> bool {
        lap == self.count
    }

    /// The sample at a part of a lap.
    pub(super) const fn sample(&self, lap: u64, fraction: u64) -> u64 {
        (lap * self.of_lap.count() + fraction) / self.stride
    }

    pub(super) fn input_angle_deg(&self, sample: u64) -> f64 {
        self.mesh.input_angle_deg(sample, self.samples)
    }

    /// States that are listed before a sample.
    pub(super) fn states_before(&self, sample: u64) -> usize {
        let Some(before) = &self.before else { return 0 };
        let of_lap = self.of_lap.count();
        whole(sample / of_lap) * before[whole(of_lap)] + before[whole(sample % of_lap)]
    }

    /// Samples of the sweep, with its end.
    pub(super) fn sample_count(&self) -> usize {
        whole(self.mesh.last_sample(self.samples) + 1)
    }

    /// States of the sweep, with those at its end.
    pub(super) fn state_count(&self) -> usize {
        whole(self.mesh.state_count(self.samples))
    }
}
