#include "deploy/launch/supervisor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <system_error>

namespace understory::launch {
namespace {

constexpr int kWrongUsage = 2;  // Exit status of a process that refuses its configuration.

double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

/// Postpones a time by a pause, but not into the future.
void postpone(std::optional<Clock::time_point>& time, Clock::duration pause,
              Clock::time_point now) {
  if (time) time = std::min(*time + pause, now);
}

}  // namespace

const char* to_string(ProcessState state) {
  switch (state) {
    case ProcessState::kWaiting:
      return "waiting";
    case ProcessState::kRunning:
      return "running";
    case ProcessState::kDegraded:
      return "degraded";
    case ProcessState::kFinished:
      return "finished";
    case ProcessState::kGivenUp:
      return "given up";
  }

  return "?";
}

Supervisor::Supervisor(std::vector<ProcessSpec> specs, const SupervisorParameters& parameters,
                       Report report)
    : parameters_(parameters), report_(std::move(report)) {
  for (auto& spec : specs) {
    Entry entry;
    entry.spec = std::move(spec);
    entry.policy = RestartPolicy(parameters.restart);
    entries_.push_back(std::move(entry));
  }
}

void Supervisor::start(const std::vector<ProcessStatus>& known, Clock::time_point now) {
  stepped_ = now;
  for (auto& entry : entries_) {
    const auto before = std::find_if(known.begin(), known.end(), [&](const auto& process) {
      return process.name == entry.spec.name;
    });

    if (before != known.end()) {
      entry.starts = before->restarts + 1;
      entry.died = now;
      entry.child = ChildProcess::adopt(before->pid, before->start_ticks);
    }

    if (!entry.child) {
      launch(entry, now);
      continue;
    }

    entry.state = ProcessState::kRunning;
    entry.started = entry.listened_since = now;
    report_(entry.spec.name, fmt::format("adopted (pid {})", entry.child->pid()));
  }
}

void Supervisor::launch(Entry& entry, Clock::time_point now) {
  entry.start_due.reset();
  entry.last_heartbeat.reset();
  entry.stopped_since.reset();
  entry.started = entry.listened_since = now;
  ++entry.starts;

  try {
    entry.child = ChildProcess::start(entry.spec.command);
  } catch (const std::system_error& error) {
    cannot_start(entry, error.what(), now);
    return;
  }

  entry.state = ProcessState::kRunning;
  if (entry.starts == 1) {
    report_(entry.spec.name, fmt::format("started (pid {})", entry.child->pid()));
  } else {
    report_(entry.spec.name,
            fmt::format("started again (pid {}) {:.0f} ms after its end was noticed; restart {}",
                        entry.child->pid(), 1e3 * seconds(now - entry.died), entry.starts - 1));
  }
}

/// At the first start the cause is the installation; later the computer lacks a resource (memory, a
/// disk), which may return.
void Supervisor::cannot_start(Entry& entry, const std::string& why, Clock::time_point now) {
  entry.died = now;
  entry.last_ending = fmt::format("cannot be started: {}", why);
  report_(entry.spec.name, entry.last_ending);
  if (entry.starts > 1) return restart_after_death(entry, now);
  entry.state = ProcessState::kGivenUp;
  refused_.push_back(entry.spec.name);
}

void Supervisor::heartbeat(const std::string& name, pid_t pid, Clock::time_point now) {
  for (auto& entry : entries_) {
    if (entry.spec.name != name || !entry.child || entry.child->pid() != pid) continue;
    entry.last_heartbeat = now;
  }
}

/// HEALTH sent during a pause may be delayed or lost, so its absence is no evidence.
void Supervisor::count_pause(Clock::time_point now) {
  const Clock::duration pause = stepped_ ? now - *stepped_ : Clock::duration(0);
  stepped_ = now;
  if (pause <= parameters_.pause) return;

  for (auto& entry : entries_) {
    postpone(entry.last_heartbeat, pause, now);
    postpone(entry.stopped_since, pause, now);
    entry.listened_since = std::min(entry.listened_since + pause, now);
  }
  postpone(stop_time_, pause, now);
  if (pause < std::chrono::seconds(1)) return;
  report_("launch", fmt::format("did not run for {:.1f} s: not counted as silence of processes",
                                seconds(pause)));
}

void Supervisor::step(Clock::time_point now) {
  count_pause(now);
  for (auto& entry : entries_) {
    if (entry.child) {
      if (const auto ending = entry.child->ended()) bury(entry, *ending, now);
    }
    if (entry.child && !stopping()) watch(entry, now);
    if (entry.start_due && now >= *entry.start_due) launch(entry, now);
  }

  if (!stopping()) return;
  kill_late(now);
  if (!last_are_asked_ && !others_run()) ask_to_end(true, now);
}

void Supervisor::kill_late(Clock::time_point now) {
  if (killed_ || now - *stop_time_ < parameters_.stop_timeout) return;
  killed_ = true;
  for (auto& entry : entries_) {
    if (!entry.child || (entry.spec.ends_last && !last_are_asked_)) continue;
    report_(entry.spec.name,
            fmt::format("does not end within {} ms: killed", parameters_.stop_timeout.count()));
    entry.child->signal(SIGKILL);
  }
}

void Supervisor::bury(Entry& entry, const Ending& ending, Clock::time_point now) {
  entry.child.reset();
  entry.died = now;
  const bool wanted = stopping() || (ending.known && ending.signal == 0 && ending.exit_code == 0);

  if (wanted) {
    entry.state = ProcessState::kFinished;
    const bool clean = ending.known && ending.signal == 0 && ending.exit_code == 0;
    report_(entry.spec.name, clean ? "ended" : ending.text());
    return;
  }

  entry.last_ending = ending.text();
  report_(entry.spec.name,
          fmt::format("{} after {:.1f} s", ending.text(), seconds(now - entry.started)));
  if (ending.known && ending.signal == 0 && ending.exit_code == kWrongUsage) {
    entry.state = ProcessState::kGivenUp;
    if (entry.starts == 1) {
      refused_.push_back(entry.spec.name);
      report_(entry.spec.name, "refuses its configuration: not started again");
    } else {
      schedule_restart(entry, entry.policy.give_up(), now);
    }
    return;
  }

  restart_after_death(entry, now);
}

void Supervisor::restart_after_death(Entry& entry, Clock::time_point now) {
  const bool was_given_up = entry.policy.is_given_up();
  const milliseconds wait = entry.policy.died(now, now - entry.started);
  if (entry.policy.is_given_up() && !was_given_up) {
    report_(entry.spec.name, fmt::format("given up: {} deaths in {:.0f} s, the last time {}",
                                         entry.policy.deaths_in_window(),
                                         seconds(parameters_.restart.window), entry.last_ending));
  }
  schedule_restart(entry, wait, now);
}

void Supervisor::schedule_restart(Entry& entry, milliseconds wait, Clock::time_point now) {
  entry.start_due = now + wait;
  entry.state = ProcessState::kWaiting;
  if (!entry.policy.is_given_up()) return;
  entry.state = ProcessState::kGivenUp;
  report_(entry.spec.name, fmt::format("is tried again in {:.0f} s", seconds(wait)));
}

void Supervisor::forgive_survivor(Entry& entry, Clock::time_point now) {
  if (!entry.policy.is_given_up() || now - entry.started < parameters_.restart.window) return;
  entry.policy.forgive();
  report_(entry.spec.name, fmt::format("has run for {:.0f} s: no longer given up",
                                       seconds(parameters_.restart.window)));
}

void Supervisor::watch(Entry& entry, Clock::time_point now) {
  forgive_survivor(entry, now);
  if (!entry.child->is_stopped()) {
    entry.stopped_since.reset();
  } else if (!entry.stopped_since) {
    entry.stopped_since = now;
  }

  const auto stopped_for = entry.stopped_since ? now - *entry.stopped_since : Clock::duration(0);
  const auto silent_for = entry.last_heartbeat ? now - *entry.last_heartbeat : Clock::duration(0);
  if (stopped_for >= parameters_.stopped_restart || silent_for >= parameters_.silent_restart) {
    report_(entry.spec.name,
            entry.stopped_since
                ? fmt::format("hangs: stopped for {:.1f} s; killed", seconds(stopped_for))
                : fmt::format("hangs: no HEALTH for {:.1f} s; killed", seconds(silent_for)));
    entry.last_heartbeat.reset();
    entry.stopped_since.reset();
    entry.child->signal(SIGKILL);
    return;
  }

  const bool is_never_heard = entry.spec.sends_health && !entry.last_heartbeat &&
                              now - entry.listened_since >= parameters_.never_heard_degraded;
  const bool degraded = stopped_for >= parameters_.stopped_degraded ||
                        silent_for >= parameters_.silent_degraded || is_never_heard;
  if (degraded && entry.state == ProcessState::kRunning) {
    report_(entry.spec.name, is_never_heard ? "DEGRADED: no HEALTH since its start"
                                            : "DEGRADED: it does not answer");
  } else if (!degraded && entry.state == ProcessState::kDegraded) {
    report_(entry.spec.name, "answers again");
  }

  entry.state = degraded ? ProcessState::kDegraded : ProcessState::kRunning;
}

void Supervisor::stop(Clock::time_point now) {
  if (stopping()) return;
  for (auto& entry : entries_) entry.start_due.reset();
  ask_to_end(false, now);
  if (!others_run()) ask_to_end(true, now);
}

/// Asks the processes with `ends_last`, or the others, to end.
void Supervisor::ask_to_end(bool last, Clock::time_point now) {
  stop_time_ = now;
  last_are_asked_ = last;
  killed_ = false;
  for (auto& entry : entries_) {
    if (!entry.child || entry.spec.ends_last != last) continue;
    // A stopped process receives SIGTERM only after it continues.
    entry.child->signal(SIGTERM);
    entry.child->signal(SIGCONT);
  }
}

/// Whether a process without `ends_last` runs.
bool Supervisor::others_run() const {
  return std::ranges::any_of(
      entries_, [](const Entry& entry) { return entry.child && !entry.spec.ends_last; });
}

bool Supervisor::stopped() const {
  return std::none_of(entries_.begin(), entries_.end(),
                      [](const Entry& entry) { return entry.child || entry.start_due; });
}

std::vector<int> Supervisor::descriptors() const {
  std::vector<int> result;
  for (const auto& entry : entries_) {
    if (entry.child) result.push_back(entry.child->descriptor());
  }
  return result;
}

Clock::time_point Supervisor::wake_up(Clock::time_point now) const {
  Clock::time_point next = now + parameters_.look_every;
  for (const auto& entry : entries_) {
    if (entry.start_due) next = std::min(next, *entry.start_due);
  }
  if (stopping() && !killed_) next = std::min(next, *stop_time_ + parameters_.stop_timeout);
  return next;
}

std::vector<ProcessStatus> Supervisor::status() const {
  std::vector<ProcessStatus> result;
  for (const auto& entry : entries_) {
    ProcessStatus status;
    status.name = entry.spec.name;
    status.state = entry.state;
    if (entry.child) {
      status.pid = entry.child->pid();
      status.start_ticks = entry.child->start_ticks();
    }
    status.restarts = entry.starts > 0 ? entry.starts - 1 : 0;
    status.last_ending = entry.last_ending;
    status.is_given_up = entry.policy.is_given_up();
    result.push_back(std::move(status));
  }

  return result;
}

}  // namespace understory::launch
