//! What docker/ gives every container, and its examples.

const COMPOSE: &str = include_str!("../../docker/compose.yaml");
const PROMETHEUS: &str = include_str!("../../docker/prometheus.yaml");

/// The services of compose.yaml with their lines.
fn services() -> Vec<(&'static str, &'static str)> {
    let services = COMPOSE.split_once("\nservices:\n").unwrap().1.split("\nvolumes:").next().unwrap();
    let blocks = services.split("\n\n").map(|block| block.trim_end().split_once(":\n").unwrap());
    blocks.map(|(name, lines)| (name.trim(), lines)).collect()
}

#[test]
fn every_container_has_limits_and_rotated_logs() {
    let hardened = COMPOSE.split("\n\n").find(|block| block.contains("&hardened")).unwrap();
    for word in ["mem_limit: 2g", "cpus: ", "pids_limit: ", "max-size: ", "max-file: "] {
        assert!(hardened.contains(word), "{word}");
    }
    assert!(COMPOSE.contains("&service\n  <<: *hardened") && COMPOSE.contains("&replica\n  <<: *service"));
    for (name, lines) in services() {
        assert!(["*hardened", "*service", "*replica"].iter().any(|anchor| lines.contains(anchor)), "{name}");
    }
}

#[test]
fn images_have_pinned_tags_and_the_project_a_name() {
    let own = "image: ${TOOTHWAVE_IMAGE:-toothwave}";
    for line in COMPOSE.lines().map(str::trim).filter(|line| line.starts_with("image: ") && *line != own) {
        let tag = line.rsplit(':').next().unwrap().trim_end_matches('}');
        assert_eq!(tag.split('.').filter(|part| part.parse::<u32>().is_ok()).count(), 3, "{line}");
    }
    assert_eq!(include_str!("../../docker/.env"), "COMPOSE_PROJECT_NAME=toothwave\n");
}

#[test]
fn prometheus_scrapes_every_container_of_the_service() {
    for (name, lines) in services() {
        let is_own = !lines.contains("*hardened");
        assert_eq!(PROMETHEUS.contains(&format!("\"{name}:8080\"")), is_own, "{name}");
    }
}

#[test]
fn nginx_listens_where_tls_is_published() {
    assert!(include_str!("../../docker/compose.tls.yaml").contains(":8443\"]"));
    assert!(include_str!("../../docker/tls/tls.conf").contains("listen 8443 ssl;"));
    assert!(include_str!("../../docker/nginx.conf").contains("include /run/tls/*.conf;"));
}
