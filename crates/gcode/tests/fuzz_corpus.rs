//! The fuzz targets of `fuzz/` on their committed corpora and on what is too large to commit: everywhere, with the ordinary
//! tests (promise P5). `.ci/judge-fuzz` lets the fuzzer look further.

#[path = "../fuzz/entries.rs"]
#[allow(unreachable_pub)] // the fuzz targets use them from outside
mod entries;

use entries::ENTRIES;
use std::path::Path;

#[test]
fn the_corpora_are_replayed() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    for (name, entry) in ENTRIES {
        let mut seeds = 0;
        for file in std::fs::read_dir(corpora.join(name)).expect("a corpus for each target") {
            let file = file.expect("an entry").path();
            eprintln!("{}", file.display());
            entry(&std::fs::read(&file).expect("a seed"));
            seeds += 1;
        }
        assert!(seeds >= 9, "{name}: {seeds} seeds");
        // Each target takes the seeds of all others too.
        for (other, _) in ENTRIES {
            for file in std::fs::read_dir(corpora.join(other)).expect("a corpus for each target") {
                entry(&std::fs::read(file.expect("an entry").path()).expect("a seed"));
            }
        }
    }
}

#[test]
fn what_is_too_large_to_commit() {
    let mega = |byte: u8| vec![byte; 1 << 20];
    let repeated = |line: &str, count: usize| line.repeat(count).into_bytes();
    let texts = [
        [b"G0 X".to_vec(), mega(b'1'), b"\nM2\n".to_vec()].concat(),
        [b"G0 (".to_vec(), mega(b'('), b"\nM2\n".to_vec()].concat(),
        mega(b'['),
        mega(0),
        mega(b'%'),
        mega(0xff),
        repeated("\n", 1 << 18),
        repeated("o1 if [1]\n", 20_000),
        (0..20_000).map(|i| format!("o{i} while [#1]\n")).collect::<String>().into_bytes(),
        (0..3000)
            .map(|i| format!("o{i} sub\no{} call\no{i} endsub\n", i + 1))
            .collect::<String>()
            .into_bytes(),
        repeated("T1 P1 D6\n", 30_000),
        repeated("5221 1\n", 30_000),
    ];
    for (name, entry) in ENTRIES {
        for text in &texts {
            eprintln!("{name}: {:?}", String::from_utf8_lossy(&text[..text.len().min(20)]));
            entry(text);
            entry(&[&[0][..], text].concat());
        }
    }
}
