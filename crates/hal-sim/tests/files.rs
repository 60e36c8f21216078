//! Writers that fail, and files that are damaged.

mod common;

use common::{SERVO_NS, machine};
use pkm_hal_sim::{StreamSteps, StreamWriter, TraceWriter, VcdSteps, VcdWriter};
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

#[test]
fn vcd_trace_and_stream_decode_to_the_same_positions() {
    for tolerance in [0, 2, 10] {
        let (mut simulation, mut source) = machine(5);
        let starts: Vec<i64> = simulation.report().joints.iter().map(|joint| joint.count).collect();
        let mut vcd = VcdWriter::new(Vec::new(), &simulation);
        let mut stream = StreamWriter::new(Vec::new(), &simulation, tolerance);
        let mut counts = Vec::new();
        for _ in 0..1000 {
            let report = simulation.tick(&mut source, &mut [&mut vcd, &mut stream]).unwrap();
            counts.push(report.joints.iter().map(|joint| joint.count).collect::<Vec<_>>());
        }
        let (vcd, stream) = (vcd.finish().unwrap(), stream.finish().unwrap());
        let mut from_vcd = VcdSteps::new(vcd.as_slice()).unwrap();
        let mut from_stream = StreamSteps::new(&stream).unwrap();
        for (tick, expected) in (1..).zip(&counts) {
            let time_ns = tick * SERVO_NS;
            let absolute = |counts: &[i64]| -> Vec<i64> {
                counts.iter().zip(&starts).map(|(count, start)| count + start).collect()
            };
            assert_eq!(absolute(from_vcd.counts_at(time_ns).unwrap()), *expected, "tick {tick}");
            assert_eq!(absolute(from_stream.counts_at(time_ns)), *expected, "tick {tick}");
        }
        // step by step: in order of time, to the same sums
        let mut steps = StreamSteps::new(&stream).unwrap();
        let (mut last, mut sums) = (0, vec![0; starts.len()]);
        while let Some((time_ns, joint, forward)) = steps.next_step() {
            assert!(time_ns >= last, "{time_ns} after {last}");
            last = time_ns;
            sums[joint] += if forward { 1 } else { -1 };
        }
        assert_eq!(sums, from_stream.counts());
        assert_eq!(sums, steps.counts());
        assert!(stream.len() * 10 < vcd.len(), "{} {}", stream.len(), vcd.len());
        // a damaged stream is refused
        assert!(StreamSteps::new(&stream[..stream.len() - 1]).is_err());
        assert!(StreamSteps::new(&[]).is_err());
        let mut bad = stream;
        let middle = bad.len() / 2;
        bad[middle] ^= 1;
        assert!(StreamSteps::new(&bad).is_err());
    }
}
