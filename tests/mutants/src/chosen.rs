/// Which mutant is chosen, as the environment says when the first place asks.
#[doc(hidden)]
pub mod mutants {
    use std::fs::File;
    use std::io::Write;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

    const UNKNOWN: usize = usize::MAX;
    const RECORDING: usize = usize::MAX - 1;
    const NONE: usize = usize::MAX - 2;

    static CHOSEN: AtomicUsize = AtomicUsize::new(UNKNOWN);
    static REACHED: [AtomicBool; 1 << 16] = [const { AtomicBool::new(false) }; 1 << 16];
    static RECORD: OnceLock<File> = OnceLock::new();

    /// 0 where none of `count` mutants from `first` on is chosen, else which of them, counted from 1.
    #[inline(always)]
    pub(crate) fn choice(first: usize, count: usize) -> usize {
        let mut chosen = CHOSEN.load(Relaxed);
        if chosen >= RECORDING {
            chosen = ask(first);
        }
        let at = chosen.wrapping_sub(first);
        if at < count { at + 1 } else { 0 }
    }

    /// What is chosen; where places are recorded, none, and this one is.
    #[cold]
    #[inline(never)]
    fn ask(first: usize) -> usize {
        if CHOSEN.load(Relaxed) == UNKNOWN {
            let record = std::env::var_os("MUTANTS_REACHED").map(|path| RECORD.get_or_init(|| File::options().append(true).create(true).open(path).unwrap()));
            let number = std::env::var("MUTANT").ok().and_then(|number| number.parse().ok()).unwrap_or(NONE);
            CHOSEN.store(if record.is_some() { RECORDING } else { number }, Relaxed);
        }
        if CHOSEN.load(Relaxed) != RECORDING {
            return CHOSEN.load(Relaxed);
        }
        if !REACHED[first].load(Relaxed) && !REACHED[first].swap(true, Relaxed) {
            RECORD.get().unwrap().write_all(format!("{first}\n").as_bytes()).unwrap();
        }
        NONE
    }
}
