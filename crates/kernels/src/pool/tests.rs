use super::*;
use std::sync::atomic::{AtomicU32, AtomicUsize};

#[test]
fn every_chunk_runs_once_for_any_thread_count() {
    for threads in [0, 1, 2, 4, 7] {
        let pool = Pool::new(threads).unwrap();
        for chunk_count in [0, 1, 2, 3, 1000] {
            let hits: Vec<AtomicU32> = (0..chunk_count).map(|_| AtomicU32::new(0)).collect();
            pool.run(chunk_count, &|chunk, worker| {
                assert!(worker < pool.threads());
                hits[chunk].fetch_add(1, Ordering::Relaxed);
            })
            .unwrap();
            assert!(hits.iter().all(|h| h.load(Ordering::Relaxed) == 1));
        }
    }
}

#[test]
fn a_small_table_stays_on_the_calling_thread() {
    let pool = Pool::new(4).unwrap();
    let caller = std::thread::current().id();
    let hits = AtomicUsize::new(0);
    pool.run_streaming(SPLIT_BYTES - 1, 1000, &|_, worker| {
        assert_eq!((worker, std::thread::current().id()), (0, caller));
        hits.fetch_add(1, Ordering::Relaxed);
    })
    .unwrap();
    pool.run_streaming(SPLIT_BYTES, 1000, &|_, _| {
        hits.fetch_add(1, Ordering::Relaxed);
    })
    .unwrap();
    assert_eq!(hits.load(Ordering::Relaxed), 2000);
}

#[test]
fn many_short_jobs_do_not_lose_a_wake_up() {
    let pool = Pool::new(3).unwrap();
    let total = AtomicUsize::new(0);
    let mut awake = None;
    for job in 0..20_000 {
        // Workers that sleep, that look, and that stop looking.
        if job % 1000 == 500 {
            awake = match awake {
                None => Some(pool.keep_awake()),
                Some(_) => None,
            };
        }
        pool.run(4, &|_, _| {
            total.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
    }
    drop(awake);
    assert_eq!(total.load(Ordering::Relaxed), 80_000);
}

#[test]
fn a_pool_that_is_kept_awake_splits_small_tables_and_ends() {
    let pool = Pool::new(3).unwrap();
    let run = || {
        let hits: Vec<AtomicU32> = (0..100).map(|_| AtomicU32::new(0)).collect();
        pool.run_streaming(SPLIT_AWAKE_BYTES, 100, &|chunk, _| {
            hits[chunk].fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
        hits.iter().all(|hit| hit.load(Ordering::Relaxed) == 1)
    };
    let awake = pool.keep_awake();
    let inner = pool.keep_awake();
    assert!(run());
    drop(inner);
    assert!(pool.shared.is_awake() && run());
    drop(awake);
    assert!(!pool.shared.is_awake() && run());
    // Workers that look when the pool ends.
    let awake = pool.keep_awake();
    std::mem::forget(awake);
    assert!(run());
}

#[test]
fn a_panic_is_an_error_and_the_pool_lives_on() {
    let pool = Pool::new(3).unwrap();
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let result = pool.run(50, &|chunk, _| assert!(chunk != 17, "seventeen"));
    let alone = Pool::new(1).unwrap().run(2, &|_, _| panic!("always"));
    std::panic::set_hook(hook);
    assert_eq!(
        result,
        Err(PoolError::Panicked {
            chunk: 17,
            chunk_count: 50,
            message: "seventeen".to_owned()
        })
    );
    assert!(alone.is_err());
    assert_eq!(pool.run(8, &|_, _| {}), Ok(()));
}

#[test]
fn nested_and_concurrent_jobs_finish() {
    let pool = Pool::new(2).unwrap();
    let total = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..200 {
                    pool.run(3, &|_, _| {
                        pool.run(2, &|_, _| {
                            total.fetch_add(1, Ordering::Relaxed);
                        })
                        .unwrap();
                    })
                    .unwrap();
                }
            });
        }
    });
    assert_eq!(total.load(Ordering::Relaxed), 4 * 200 * 3 * 2);
}

#[test]
fn the_callers_floating_point_mode_is_untouched() {
    let pool = Pool::new(2).unwrap();
    let before = crate::flush::read_mode() & !0x3f;
    pool.run(4, &|_, _| {}).unwrap();
    assert_eq!(crate::flush::read_mode() & !0x3f, before);
}
