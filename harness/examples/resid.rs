use std::path::Path;
use touchdown::diagnose::{prepare::prepare, search::*};
use touchdown::model::estimate::*;
fn main(){ for d in std::env::args().skip(1) {
 let c = touchdown::record::load(Path::new(&d)).unwrap();
 let (mut data,g)=prepare(&c).unwrap();
 for r in &mut data.records { r.at_first = true; }
 if data.kind==touchdown::record::Kind::Indentation { let w={ let s=Search::new(&c,&data); let b=s.base(&c,&g); s.effective_weights(&b.point)}; for (r,w) in data.records.iter_mut().zip(w) { r.weight[0]=w; } }
 let sp={ let s=Search::new(&c,&data); let b=s.base(&c,&g); s.spikes(&b.point)}; for (r,ch,k) in &sp { data.records[*r].weight[*ch][*k]=0.0; }
 if !sp.is_empty() { println!("spikes {}",sp.len()); }
 let s=Search::new(&c,&data);
 let b=s.base(&c,&g);
 let m=s.model(&MakeUp::default(),1.,1.,0.);
 let p=Problem::new(&data,&m);
 println!("{} chi2/n {:.3} noise {:?} nuis {:?}",c.name,b.point.chi2/data.samples() as f64,data.noise,data.nuisances());
 let l=p.linearise(&b.point).unwrap();
 for (r,bl) in l.blocks.iter().enumerate() {
  let (t,_)=p.predict(&b.point.theta,r,&b.point.locals[r]);
  let time=&data.records[r].setup.time; let n=time.len();
  let mut s=format!("{} loc {:?}",data.records[r].file,b.point.locals[r].iter().map(|v|format!("{v:.2e}")).collect::<Vec<_>>().join(" "));
  for (ci,ch) in data.compared(r).enumerate() { let w=&bl.residual[ci*n..(ci+1)*n];
   let ph=|a:f64,b:f64|{ let v:Vec<f64>=(0..n).filter(|i|time[*i]>=a&&time[*i]<b).map(|i|w[i]).collect(); let m=v.iter().sum::<f64>()/v.len() as f64; let q=v.iter().map(|x|x*x).sum::<f64>()/v.len() as f64; let mx=v.iter().fold(0f64,|m,x|m.max(x.abs())); format!("{:.2}/{:+.2}/{:.0}",q.sqrt(),m,mx)};
   s+=&format!(" | {} {} {} {} {}",&ch.name()[..3],ph(-9e9,t.touch),ph(t.touch,t.deepest),ph(t.deepest,t.leave),ph(t.leave,9e9)); }
  println!("{s}");
 }
}}
