//! Work on all cores with the same result for any number of them: every item is computed by itself and kept in its place.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// As many threads as there are cores.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// `work(0)` to `work(count − 1)`, in this order whoever did them, on `threads` threads.
pub fn map<T: Send>(count: usize, threads: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let threads = threads.clamp(1, count.max(1));
    if threads == 1 {
        return (0..count).map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let mut mine = Vec::new();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        break;
                    }
                    mine.push((index, work(index)));
                }
                // A poisoned list means that another worker panicked; its panic ends the scope.
                if let Ok(mut done) = done.lock() {
                    done.extend(mine);
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, item)| item).collect()
}

/// Calls `work(index, piece)` for consecutive pieces of `length` items, on `threads` threads.
pub fn for_pieces<T: Send>(
    items: &mut [T],
    length: usize,
    threads: usize,
    work: impl Fn(usize, &mut [T]) + Sync,
) {
    let pieces = Mutex::new(items.chunks_mut(length.max(1)).enumerate());
    thread::scope(|scope| {
        let worker = || {
            loop {
                let piece = pieces.lock().ok().and_then(|mut pieces| pieces.next());
                let Some((index, piece)) = piece else { break };
                work(index, piece);
            }
        };
        for _ in 1..threads {
            scope.spawn(worker);
        }
        worker();
    });
}

#[cfg(test)]
mod tests {
    #[test]
    fn order_does_not_depend_on_threads() {
        let one = super::map(1000, 1, |i| i * i);
        assert_eq!(one[31], 961);
        assert_eq!(super::map(1000, 7, |i| i * i), one);
        assert_eq!(super::map(0, 7, |i| i), Vec::<usize>::new());
        let mut items = vec![0; 1001];
        super::for_pieces(&mut items, 10, 5, |index, piece| piece.fill(index));
        assert!(items.iter().enumerate().all(|(i, &item)| item == i / 10));
    }
}
