//! Ready design documents, compiled in from `examples/`.

/// A design document by name.
#[derive(Debug, Clone, Copy)]
pub struct Example {
    /// Its name in the path.
    pub name: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// The document.
    pub document: &'static str,
}

/// All of them.
pub const EXAMPLES: [Example; 9] = [
    Example {
        name: "paper-5.1",
        title: "The paper's case 5.1: no undercut, seven teeth in each zone",
        document: include_str!("../../../examples/paper-5.1.json"),
    },
    Example {
        name: "paper-5.2",
        title: "The paper's case 5.2: undercut, every second slot filled",
        document: include_str!("../../../examples/paper-5.2.json"),
    },
    Example {
        name: "paper-5.2-bored",
        title: "Case 5.2 bored at 52.8227 mm: three or four teeth in each zone, as in the paper's figures 20 to 25",
        document: include_str!("../../../examples/paper-5.2-bored.json"),
    },
    Example {
        name: "ring-with-more-teeth",
        title: "A ring with two teeth more than the carrier, fixed stiffnesses, virtual work",
        document: include_str!("../../../examples/ring-with-more-teeth.json"),
    },
    Example {
        name: "eccentric-roller",
        title: "An eccentric circle pushes rollers, the ring has one tooth more: the usual form of open wave reducers",
        document: include_str!("../../../examples/eccentric-roller.json"),
    },
    Example {
        name: "harmonic-three-lobes",
        title: "A harmonic cam of three lobes: three zones share the load",
        document: include_str!("../../../examples/harmonic-three-lobes.json"),
    },
    Example {
        name: "harmonic-path",
        title: "Teeth that move along a cosine",
        document: include_str!("../../../examples/harmonic-path.json"),
    },
    Example {
        name: "balls",
        title: "Balls in grooves around an eccentric circle, by Hertz's law of point contacts",
        document: include_str!("../../../examples/balls.json"),
    },
    Example {
        name: "flat-sided",
        title: "Case 5.1 with flat-sided teeth, which lie on the walls of their slots",
        document: include_str!("../../../examples/flat-sided.json"),
    },
];

/// The example of that name.
pub fn by_name(name: &str) -> Option<&'static Example> {
    EXAMPLES.iter().find(|example| example.name == name)
}
