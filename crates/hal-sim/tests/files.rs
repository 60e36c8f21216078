//! Writers that fail, and files that are damaged.

mod common;

use common::machine;
use pkm_hal_sim::{TraceWriter, VcdSteps, VcdWriter};
use std::io::{self, Write};

/// A disk with room for so many bytes.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if bytes.len() > self.0 {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.0 -= bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_reported_and_the_motion_goes_on() {
    let (mut simulation, mut source) = machine(2);
    let mut vcd = VcdWriter::new(Full(100_000), &simulation);
    let mut trace = TraceWriter::new(Full(100_000), &simulation);
    for _ in 0..5000 {
        simulation.tick(&mut source, &mut [&mut vcd, &mut trace]).unwrap();
    }
    assert_eq!(simulation.tick_number(), 5000);
    assert_eq!(vcd.error().map(io::Error::kind), Some(io::ErrorKind::StorageFull));
    assert_eq!(trace.finish().err().map(|error| error.kind()), Some(io::ErrorKind::StorageFull));
    assert_eq!(vcd.finish().err().map(|error| error.kind()), Some(io::ErrorKind::StorageFull));
}

#[test]
fn a_damaged_vcd_is_refused() {
    let (mut simulation, mut source) = machine(1);
    let mut vcd = VcdWriter::new(Vec::new(), &simulation);
    for _ in 0..100 {
        simulation.tick(&mut source, &mut [&mut vcd]).unwrap();
    }
    let good = String::from_utf8(vcd.finish().unwrap()).unwrap();
    let count = |text: &str| -> io::Result<i64> {
        let mut steps = VcdSteps::new(text.as_bytes())?;
        steps.counts_at(u64::MAX).map(|counts| counts[0])
    };
    assert_eq!(count(&good).unwrap(), simulation.report().joints[0].count);
    assert!(good.contains("$timescale 100 ns $end"), "{good}");
    assert!(good.ends_with("#1000000\n"), "{good}");
    assert!(count("").is_err());
    assert!(count(&good.replace("$timescale 100 ns $end", "")).is_err());
    assert!(count(&good.replace("joint0_dir", "other")).is_err());
    assert!(count(&good.replacen("#0", "#999999999", 1)).is_err());
    // cut off inside an edge
    let cut = good.rfind("\n1").unwrap() + 2;
    assert!(count(&good[..cut]).is_err());
}
