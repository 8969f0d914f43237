//! A registration that is stopped, at any moment.

use super::*;
use std::time::Duration;

#[test]
fn it_stops_at_any_moment_and_leaves_the_pose() {
    // Fails if some part of the work does not ask whether it should stop, or what was open is changed by work that was stopped.
    let [a, b] = [Which::A, Which::B].map(|which| Arc::new(skull(which, 96, &Progress::default()).unwrap()));
    let mut open = opened([&b, &a], [226.0; 2]);
    let marks = (0..400).map(|n| {
        let mut random = random(n / 2);
        let point = DVec3::new(random.unit(), random.unit(), random.unit()) * 100.0;
        let scan = Some([&b, &a][n as usize % 2].name().to_owned());
        bregma_session::Landmark { scan, ..bregma_session::Landmark::at(format!("{}", n / 2), point) }
    });
    open.landmarks = marks.collect();
    let start = Some(motion(&mut random(1), DVec3::ZERO, 8.0, 9.0));
    let mut random = random(77);
    // Threads of its own: those that all tests share may be at another's work when this one is to stop.
    let pool = rayon::ThreadPoolBuilder::new().build().unwrap();
    for (what, by, start) in [
        ("surfaces", By::Surfaces, start),
        ("anywhere", By::Surfaces, None),
        ("intensities", By::Intensities, start),
        ("landmarks", By::Landmarks, None),
    ] {
        let order = Order { by, start, ..Order::default() };
        let before = Instant::now();
        register(&open, [0, 1], &order, &Progress::default()).unwrap();
        let whole_s = before.elapsed().as_secs_f64();
        let scene = open.scene.clone();
        let (mut worst_s, mut stopped): (f64, _) = (0.0, 0);
        let count = seeds(4);
        for _ in 0..count {
            let progress = Progress::default();
            let wait = Duration::from_secs_f64(random.unit() * whole_s);
            let asked = std::thread::scope(|scope| {
                let asker = scope.spawn(|| {
                    std::thread::sleep(wait);
                    progress.cancel();
                    Instant::now()
                });
                let found = pool.install(|| register(&open, [0, 1], &order, &progress));
                let ended = Instant::now();
                if let Err(error) = &found {
                    assert!(matches!(error, RegisterError::Cancelled(Cancelled)), "{what}: {error}");
                    stopped += 1;
                }
                ended.saturating_duration_since(asker.join().unwrap()).as_secs_f64()
            });
            worst_s = worst_s.max(asked);
        }
        println!("{what}, {whole_s:.2} s, stopped at {count} moments: {stopped} gave no pose; at worst {worst_s:.3} s until it did");
        assert_eq!(open.scene, scene);
        // 0.2 s is wanted where nothing else runs.
        assert!(worst_s < 0.6, "{what}: {worst_s}");
        assert!(stopped > 0 || by == By::Landmarks, "{what}");
    }
}
