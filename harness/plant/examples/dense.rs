use plant::recipe::{write_campaign, Recipe};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let n: usize = a[2].parse().unwrap();
    let span: f64 = a[3].parse().unwrap();
    let noise: f64 = a[4].parse().unwrap();
    let mut r = Recipe { samples: n, interval: span / n as f64, seed: 5, ..Recipe::default() };
    for s in r.noise.iter_mut() {
        *s *= noise;
    }
    if a.len() > 5 {
        r.physics.law.secondary_stiffening.stiffness = a[5].parse().unwrap();
        r.physics.law.secondary_stiffening.depth = a[6].parse().unwrap();
    }
    write_campaign(std::path::Path::new(&a[1]), &r).unwrap();
}
