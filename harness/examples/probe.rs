use std::path::Path;
use touchdown::diagnose::{prepare::prepare, search::*};
use touchdown::model::estimate::Options;
fn main(){ for d in std::env::args().skip(1) {
 let c = touchdown::record::load(Path::new(&d)).unwrap();
 let t0=std::time::Instant::now();
 let (data,g)=match prepare(&c){Ok(x)=>x,Err(e)=>{println!("{} INVALID {e}",c.name);continue}};
 let mut data=data;
 if std::env::var("TOUCH").is_err() { for r in &mut data.records { r.at_first = true; } }
 if data.kind==touchdown::record::Kind::Indentation { let w={ let s=Search::new(&c,&data); let b=s.base(&c,&g); s.effective_weights(&b.point)}; for (r,w) in data.records.iter_mut().zip(w) { r.weight[0]=w; } }
 let sp={ let s=Search::new(&c,&data); let b=s.base(&c,&g); s.spikes(&b.point)}; for (r,ch,k) in &sp { data.records[*r].weight[*ch][*k]=0.0; }
 if !sp.is_empty() { println!("spikes {}",sp.len()); }
 let s=Search::new(&c,&data);
 let b=s.base(&c,&g);
 let n=data.samples() as f64;
 println!("{} base chi2 {:.1} n {} ratio {:.4} it {} conv {} theta {:.4?} {:?}",c.name,b.point.chi2,n,b.point.chi2/n,b.iterations,b.converged,b.point.theta,t0.elapsed());
 let cands=s.candidates();
 let v=s.screen(&MakeUp::default(),&b,&cands,2,&Options{iterations:10,hopeless:1.0,..Default::default()});
 for (t,f) in v.iter().take(std::env::var("TOP").map_or(4,|v|v.parse().unwrap())){ println!("   {:24} {:28} dchi2 {:.1} ratio {:.4} it {} theta {:.4?}",t.mechanism.name,t.form.label,b.point.chi2-f.point.chi2,f.point.chi2/n,f.iterations,&f.point.theta[b.point.theta.len()..]); }
 println!("   {:?}",t0.elapsed());
}}
