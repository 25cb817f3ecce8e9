//! Single requests beside studies: `cargo bench --bench beside_studies`.
//!
//! One service is idle, then computes two studies, then is idle again. Meanwhile one client sends sweeps of designs that no cache has.
//! Printed are medians, and the ratio of the one beside studies to the larger one of the idle service.

use std::error::Error;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

type Failure = Box<dyn Error>;

const DESIGN: &str = include_str!("../examples/paper-5.1.json");

/// Requests of a phase.
const REQUESTS: usize = 1000;

fn main() -> Result<(), Failure> {
    let mut service = Service::start()?;
    println!("| sweep of | idle ms | beside two studies ms | idle again ms | ratio |\n|---|---|---|---|---|");
    for samples in [50, 5000] {
        service.median_ms(samples, REQUESTS / 10)?;
        let before_ms = service.median_ms(samples, REQUESTS)?;
        let studies = [service.begin("/load/input_torque_nm")?, service.begin("/drive/teeth/width_mm")?];
        let beside_ms = service.median_ms(samples, REQUESTS)?;
        for id in studies {
            let place = format!("/v1/studies/{id}");
            let stands = service.ask("GET", &place, "")?;
            if stands["state"] != "running" {
                return Err("a study was over too soon: ask for more variants".into());
            }
            // The first cancels it, the second forgets it.
            service.ask("DELETE", &place, "")?;
            service.ask("DELETE", &place, "")?;
        }
        let after_ms = service.median_ms(samples, REQUESTS)?;
        let ratio = beside_ms / before_ms.max(after_ms);
        println!("| {samples} intervals | {before_ms:.3} | {beside_ms:.3} | {after_ms:.3} | {ratio:.2} |");
    }
    Ok(())
}

/// A running service, and a connection to it.
struct Service {
    child: Child,
    connection: BufReader<TcpStream>,
    asked: u32,
    /// Open as long as the service runs, which may print more.
    _output: BufReader<ChildStdout>,
}

impl Service {
    fn start() -> Result<Self, Failure> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_toothwave"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "off"]);
        let mut child = command.stdout(Stdio::piped()).spawn()?;
        let mut output = BufReader::new(child.stdout.take().ok_or("no pipe")?);
        let mut line = String::new();
        output.read_line(&mut line)?;
        let address = line.split_whitespace().last().ok_or("the service said nothing")?;
        let stream = TcpStream::connect(address.trim_start_matches("http://"))?;
        stream.set_nodelay(true)?;
        Ok(Self { child, connection: BufReader::new(stream), asked: 0, _output: output })
    }

    /// Begins a map that takes longer than a phase, and returns its id.
    fn begin(&mut self, pointer: &str) -> Result<String, Failure> {
        let range = |low: f64, high: f64| json!({ "min": low, "max": high, "steps": 2500 });
        let over = json!({ pointer: range(10.0, 20.0), "/drive/teeth/radius_mm": range(4.0, 5.0) });
        let design: Value = serde_json::from_str(DESIGN)?;
        let study = json!({ "study": "map", "base": design, "over": over, "quantities": ["peak_stress_ring_mpa"] });
        let begun = self.ask("POST", "/v1/studies", &study.to_string())?;
        Ok(begun["id"].as_str().ok_or_else(|| format!("no study: {begun}"))?.to_owned())
    }

    fn median_ms(&mut self, samples: u32, requests: usize) -> Result<f64, Failure> {
        let mut design: Value = serde_json::from_str(DESIGN)?;
        design["sweep"] = json!({ "samples": samples });
        let mut times = Vec::with_capacity(requests);
        for _ in 0..requests {
            self.asked += 1;
            design["load"]["input_torque_nm"] = json!(10.0 + 1e-6 * f64::from(self.asked));
            let text = design.to_string();
            let started = Instant::now();
            let answer = self.ask("POST", "/v1/sweep", &text)?;
            times.push(started.elapsed());
            if answer["peaks"].is_null() {
                return Err(format!("no sweep: {answer}").into());
            }
        }
        times.sort();
        let median: Duration = times[times.len() / 2];
        Ok(1e3 * median.as_secs_f64())
    }

    fn ask(&mut self, method: &str, path: &str, body: &str) -> Result<Value, Failure> {
        let length = body.len();
        let request = format!(
            "{method} {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n{body}"
        );
        self.connection.get_mut().write_all(request.as_bytes())?;
        let mut length = 0;
        loop {
            let mut line = String::new();
            self.connection.read_line(&mut line)?;
            match line.trim_end().split_once(": ") {
                Some((name, value)) if name.eq_ignore_ascii_case("content-length") => length = value.parse()?,
                None if line.trim_end().is_empty() => break,
                _ => {}
            }
        }
        let mut bytes = vec![0; length];
        self.connection.read_exact(&mut bytes)?;
        Ok(if bytes.is_empty() { Value::Null } else { serde_json::from_slice(&bytes)? })
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
