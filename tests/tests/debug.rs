use bregma_renderer::*; use bregma_volume::*; use glam::*; use bregma_tests::*; use std::sync::Arc;
#[test] fn dbg() {
    let grid = Grid::new([40; 3], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let mut random = Random(7);
    let samples: Vec<f64> = (0..grid.len()).map(|_| (random.next() * 255.0).floor()).collect();
    let v = volume("noise", grid, Samples::U8(samples.iter().map(|&v| v as u8).collect()));
    let [low, high] = v.range();
    let volumes=[v];
    for (az,el) in [(20.0,10.0),(200.0,-50.0)] {
    let mut s = Scene::of(&volumes); s.layers[0].iso = low + 0.93 * (high - low);
    s.camera = Camera::orbit(&Bounds::of(volumes.iter().map(|v| v.grid())), az, el);
    let surf=&s.surfaces(&volumes).unwrap()[0].1;
    let ray = s.camera.ray(75.0, 200.0, 256, 256);
    for i in -20..=20 { let t=122.46502685546875 + i as f64*1e-4; let p=surf.grid.index(ray.at(t)); let (f,g)=reference::field(surf,p); println!("{az} {t} {:?} {f:e} {g:?}", p.0); }
    println!("{:?}", reference::crossings(surf,&ray).iter().map(|c|(c.t_mm,c.kind)).collect::<Vec<_>>());
    let mut cpu=CpuRenderer::default(); let p=cpu.render(&volumes,&s,256,256).unwrap(); println!("{}", p.depth_mm[200*256+75]);
    }
}
