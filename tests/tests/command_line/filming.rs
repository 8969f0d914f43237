//! `bregma film`.

use super::*;
use bregma_synthetic::Random;
use std::process::Stdio;
use std::time::Duration;

#[test]
fn a_killed_film_goes_on_and_is_the_same_to_the_last_byte() {
    // Fails if a kill leaves half a frame that is taken for one, a film that is none, or frames beside a whole film. `BREGMA_KILLS=20` kills as
    // often.
    let d = folder("filming");
    ok(&d, "demo --size 48 --out .");
    let film = |out: &str| format!("film a.nrrd --backend cpu --turntable 1 --fps 20 --size 320x240 --samples 4 --letters --out {out}");
    let begun = std::time::Instant::now();
    ok(&d, &film("whole.mp4"));
    let whole_ms = begun.elapsed().as_millis() as f64;
    let whole = std::fs::read(d.join("whole.mp4")).unwrap();
    // What a kill leaves of the record is no film of another.
    std::fs::create_dir(d.join("left.mp4.frames")).unwrap();
    std::fs::write(d.join("left.mp4.frames/.bregma-1-0.part"), "{").unwrap();
    ok(&d, &film("left.mp4"));
    assert!(!d.join("left.mp4.frames").exists() && std::fs::read(d.join("left.mp4")).unwrap() == whole);
    let kills = std::env::var("BREGMA_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(5);
    let program = std::env::current_exe().unwrap().parent().unwrap().parent().unwrap().join("bregma");
    let mut random = Random(20);
    let mut under_way = 0;
    for n in 0..kills {
        let line = film(&format!("{n}.mp4"));
        for _ in 0..3 {
            let mut child =
                Command::new(&program).args(line.split(' ')).current_dir(&d).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
            std::thread::sleep(Duration::from_millis((random.unit() * whole_ms) as u64));
            // It may have ended by itself.
            child.kill().unwrap();
            child.wait().unwrap();
            under_way += usize::from(d.join(format!("{n}.mp4.frames/00000.png")).exists());
        }
        ok(&d, &line);
        assert!(std::fs::read(d.join(format!("{n}.mp4"))).unwrap() == whole, "film {n} is another one");
        assert!(!d.join(format!("{n}.mp4.frames")).exists());
    }
    println!("{kills} films killed, {under_way} times with frames on the disk");
    assert!(under_way > 0);
}

#[test]
fn films_that_cannot_be_are_one_clear_line() {
    // Fails if a film of nothing is drawn, or a list of keys that is none passes.
    let d = folder("no-film");
    nrrd(&d.join("ball.nrrd"), CUBE, &ball());
    let usage = |line: &str, says: &str| {
        let out = bregma(&d, line);
        assert!(out.status.code() == Some(2) && stderr(&out).contains(says), "{line}: {}", stderr(&out));
    };
    usage("film ball.nrrd --out a.mp4", "--turntable SECONDS");
    usage("film ball.nrrd --turntable 1 --plate frontalis,basilaris --out a.mp4", "one picture");
    fails(&d, "film ball.nrrd --turntable 1 --out a.avi", &[".mp4, .apng or .gif"]);
    fails(&d, "film ball.nrrd --turntable 1 --size 101x100 --out a.mp4", &["even number"]);
    fails(&d, "film ball.nrrd --turntable 1 --fps 1000 --out a.mp4", &["1 to 240"]);
    std::fs::write(d.join("keys.json"), r#"{"keys": [{"at_s": 0, "orbit": [0, 0]}, {"at_s": 0.2, "orbit": [0, 40], "isovalue": 3}]}"#)
        .unwrap();
    fails(&d, "film ball.nrrd --keys keys.json --out a.gif", &["keys.json", "no list of keys", "isovalue"]);
    std::fs::write(d.join("keys.json"), r#"{"keys": [{"at_s": 0, "orbit": [0, 0]}, {"at_s": 0.2, "orbit": [0, 40], "iso": [0]}]}"#)
        .unwrap();
    let told = stdout(&ok(&d, "film ball.nrrd --iso 0 --keys keys.json --fps 10 --size 64x48 --out a.gif"));
    assert!(told.contains("2 frames") && !d.join("a.gif.frames").exists(), "{told}");
}

#[test]
fn the_film_of_a_session_is_made_unless_another_is_asked_for() {
    // Fails if a session's film cannot be made without the window, or stands in the way of another one.
    let d = folder("session-film");
    ok(&d, "demo --size 16 --out .");
    let source = bregma_session::Source { file: d.join("a.nrrd"), ..Default::default() };
    let mut opened = bregma_session::Opened::read(&[source], &Default::default()).unwrap();
    let keys = [0.0, 0.5].map(|at_s| bregma_session::film::Key { at_s, orbit: Some([90.0 * at_s, 0.0]), ..Default::default() });
    opened.film = Some(bregma_session::film::Film { seconds: 0.5, fps: 8.0, turns: None, keys: keys.into() }.into());
    bregma_session::Session::of(&opened, &d).write(&d.join("session.json")).unwrap();
    let made = |asked: &str| {
        ok(&d, &format!("film session.json --backend cpu --size 32x32 {asked} --out frames"));
        let count =
            std::fs::read_dir(d.join("frames")).unwrap().filter(|file| file.as_ref().unwrap().path().extension().unwrap() == "png").count();
        std::fs::remove_dir_all(d.join("frames")).unwrap();
        count
    };
    assert_eq!((made(""), made("--fps 16"), made("--turntable 1 --fps 6")), (4, 8, 6));
}
