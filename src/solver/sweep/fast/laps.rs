//! Assignment of a sweep's samples to laps of its mesh, and the teeth at each sample (docs/explanation/theory.md
//! sections 3 and 9).

use std::ops::Range;

use crate::mesh::{Mesh, Neighbours, Samples};

/// Converts a count to an index. The caller has bounded the sweep to what fits in memory.
pub(super) fn whole(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}

/// Order of the teeth at an input angle in a tile: all places in sequence, repeated for each distinguished tooth.
/// Within each sequence, teeth whose places are a multiple of `apart` from the first are adjacent: neighbours in a
/// zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Number of teeth that are distinguished at each place.
    pub(super) at_each_place: usize,
    /// Distance of the places of neighbours in a zone.
    pub(super) apart: usize,
}

impl Layout {
    /// Returns the index of a place, counted from 1, among `places`, for the first of the distinguished teeth.
    pub(super) fn index(self, place: usize, places: usize) -> usize {
        let (before, residue) = ((place - 1) / self.apart, (place - 1) % self.apart);
        let of_residues_before = residue * (places / self.apart) + residue.min(places % self.apart);
        of_residues_before + before
    }
}

/// Teeth of a zone that are adjacent both in a tile and in the answer.
#[derive(Debug)]
pub(super) struct Listed {
    /// Their indices in a row of the tile.
    pub(super) at: Range<usize>,
    pub(super) teeth: Neighbours,
}

#[derive(Debug, Default)]
pub(super) struct LapTeeth {
    runs: Vec<Neighbours>,
    /// Listed teeth in the order of the answer.
    pub(super) listed: Vec<Listed>,
    /// Indices of the same teeth in chunks, independent of the lobe.
    pub(super) stretches: Vec<Range<usize>>,
}

impl LapTeeth {
    pub(super) fn list(&mut self, mesh: &Mesh, layout: Layout, places: usize, lap: u64) {
        mesh.list(places as u64, lap, &mut self.runs);
        let apart = mesh.laps_of_load_period();
        self.listed.clear();
        self.listed.extend(self.runs.iter().map(|&teeth| {
            // Lobes that differ by a multiple of this number carry alike.
            let which = if layout.at_each_place > 1 { whole(teeth.lobe / apart) } else { 0 };
            let start = which * places + layout.index(whole(teeth.first_place), places);
            Listed { at: start..start + whole(teeth.count), teeth }
        }));
        self.stretches.clear();
        for Listed { at, .. } in &self.listed {
            match self.stretches.last_mut() {
                Some(last) if last.end == at.start => last.end = at.end,
                _ => self.stretches.push(at.clone()),
            }
        }
    }
}

/// Laps of a sweep over equal intervals. For sample n of N in a load period of L laps, `n L = l N + f` with f below N.
/// It is in lap l at f/N of the lap. With `G = gcd(N, L)`, `S = N/G` and `q = L/G` this is `n q = l S + f/G`.
pub(super) struct Laps {
    /// Mesh of the sweep.
    pub(super) mesh: Mesh,
    pub(super) samples: Samples,
    /// `S`.
    pub(super) of_lap: Samples,
    /// `q`: distance between successive samples of a lap, in S parts of it.
    pub(super) stride: u64,
    pub(super) count: u64,
    /// Number of listed teeth before each of S successive samples, which cover all parts of a lap, and in total. Set if
    /// the teeth of all zones are listed.
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

    /// Returns true if the teeth of all zones are listed.
    pub(super) const fn are_listed(&self) -> bool {
        self.before.is_some()
    }

    /// Returns the laps with a sample at this part. If teeth are listed, this includes the lap that begins at the
    /// sweep's end.
    pub(super) fn with(&self, fraction: u64) -> impl Iterator<Item = u64> + use<> {
        let Self { stride, count, .. } = *self;
        let of_lap = self.of_lap.count();
        let first = (0..stride).find(|lap| (lap * of_lap + fraction).is_multiple_of(stride)).unwrap_or(count);
        let end = (fraction == 0 && self.are_listed()).then_some(count);
        (first..count).step_by(whole(stride)).chain(end)
    }

    /// Returns the sample at a part of a lap.
    pub(super) const fn sample(&self, lap: u64, fraction: u64) -> u64 {
        (lap * self.of_lap.count() + fraction) / self.stride
    }

    pub(super) fn input_angle_deg(&self, sample: u64) -> f64 {
        self.mesh.input_angle_deg(sample, self.samples)
    }

    /// Returns the number of listed states before a sample.
    pub(super) fn states_before(&self, sample: u64) -> usize {
        let Some(before) = &self.before else { return 0 };
        let of_lap = self.of_lap.count();
        whole(sample / of_lap) * before[whole(of_lap)] + before[whole(sample % of_lap)]
    }
}
