// Loaded before the first paint, so that a chosen theme does not flash. A theme is 'light', 'dark' or left to the system.
try {
  const theme = localStorage.getItem('theme');
  if (theme === 'light' || theme === 'dark') document.documentElement.dataset.theme = theme;
} catch {
  // Storage may be forbidden; then the system's theme stands.
}
