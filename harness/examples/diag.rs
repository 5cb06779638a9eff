use std::path::Path;
fn main(){ let out=std::env::args().nth(1).unwrap(); for d in std::env::args().skip(2) {
 let c = touchdown::record::load(Path::new(&d)).unwrap();
 let t0=std::time::Instant::now();
 match touchdown::diagnose::run::diagnose(&c) { Err(e)=>println!("{} INVALID {e}",c.name), Ok(o)=>{
  let dir=Path::new(&out).join(&c.folder);
  for (n,h) in [("before",o.before.as_ref()),("after",o.after.as_ref().or(o.before.as_ref()))] { let h=h.unwrap(); let p=dir.join("predictions").join(n); std::fs::create_dir_all(&p).unwrap();
   for (r,y) in c.recordings.iter().zip(&h.readings) { let mut s=r.columns.iter().map(|k|format!("{} [{}]",k.name,k.unit)).collect::<Vec<_>>().join(",")+"\n";
    for i in 0..r.time.len() { s+=&r.columns.iter().map(|k|{ let v=match k.name.as_str(){"time"=>r.time[i],"force"=>y[0][i],"acceleration"=>y[1][i],_=>y[2][i]}; format!("{:e}",v/k.to_si)}).collect::<Vec<_>>().join(","); s+="\n"; }
    std::fs::write(p.join(&r.file),s).unwrap(); } }
  std::fs::write(dir.join("verdict.json"),serde_json::to_string_pretty(&o.verdict).unwrap()).unwrap();
  println!("{} {} {} {:.1?} {:?}",c.name,o.verdict["missing"].as_array().unwrap().iter().map(|m|format!("{} {}",m["mechanism"],m["form"])).collect::<Vec<_>>().join(" + "),o.verdict["unexplained"],o.candidates.iter().take(4).collect::<Vec<_>>(),t0.elapsed());
 }}
}}
