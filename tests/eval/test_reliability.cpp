// The judge of drives with faults: against drives whose errors are known.
#include <signal.h>

#include <cmath>
#include <fstream>
#include <map>
#include <random>

#include "eval/experiments/reliability/pose_judge.hpp"
#include "eval/experiments/reliability/processes.hpp"
#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::eval;
using namespace understory::eval::experiments::reliability;

namespace {

constexpr double kSigma_m = 0.05;
constexpr double kSigma_rad = 0.01;

geometry::SE2 true_pose(double at_s) {
  return {3.0 * at_s, 10.0 * std::sin(0.1 * at_s), std::sin(0.07 * at_s)};
}

/// A drive of 100 s at 10 Hz, in a frame of its own, with errors as stated.
struct Drive {
  explicit Drive(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const geometry::SE2 frame_T_world(5.0, -3.0, 1.0);
    for (int i = 0; i <= 1000; ++i) {
      const model::Utime utime = i * 100'000;
      truth.push_back({utime, true_pose(0.1 * i)});
      SaidPose pose;
      pose.utime = utime;
      pose.covariance = Eigen::Vector3d(kSigma_m, kSigma_m, kSigma_rad).cwiseAbs2().asDiagonal();
      pose.frame_T_vehicle = frame_T_world * truth.back().pose;
      // The first pose ties the frame to the truth.
      const double noise = i == 0 ? 0.0 : 1.0;
      pose.frame_T_vehicle =
          pose.frame_T_vehicle * geometry::SE2(noise * kSigma_m * normal(random),
                                               noise * kSigma_m * normal(random),
                                               noise * kSigma_rad * normal(random));
      said.push_back(pose);
    }
  }
  /// Moves what is said by so much in [from, to).
  void displace(double from_s, double to_s, double by_m) {
    for (SaidPose& pose : said) {
      const double at_s = 1e-6 * static_cast<double>(pose.utime);
      if (at_s >= from_s && at_s < to_s)
        pose.frame_T_vehicle = pose.frame_T_vehicle * geometry::SE2(by_m, 0.0, 0.0);
    }
  }

  std::vector<SaidPose> said;
  std::vector<metrics::StampedPose> truth;
};

/// Whether a process has ended that nobody has waited for yet.
bool is_ended(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string line;
  std::getline(file, line);
  const auto behind_name = line.rfind(") ");
  return behind_name == std::string::npos || line[behind_name + 2] == 'Z';
}

const std::vector<Fault> kFaults = {{.what = "a", .from_s = 30.0, .to_s = 35.0},
                                    {.what = "b", .from_s = 60.0, .to_s = 61.0}};

}  // namespace

TEST_CASE("errors as stated are within 3 sigma after every fault", "[reliability]") {
  std::size_t poses = 0;
  std::size_t within = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Drive drive(seed);
    for (const AfterFault& score : judge(drive.said, drive.truth, kFaults)) {
      poses += score.poses;
      within += score.within_3_sigma;
      CHECK(score.goes_on);
      CHECK_FALSE(score.is_announced);
      CHECK(score.largest_step_m < 8.0 * kSigma_m);
      CHECK(score.ok_while_far_s == 0.0);
    }
    const Broken none = broken(drive.said);
    CHECK(none.not_finite + none.not_positive_definite + none.not_later == 0);
  }
  CHECK(poses > 10000);
  CHECK(static_cast<double>(within) / static_cast<double>(poses) == Approx(0.9973).margin(0.002));
}

TEST_CASE("what is wrong within a fault does not count, what is wrong after it does",
          "[reliability]") {
  Drive drive(3);
  drive.displace(30.0, 35.15, 50.0);
  drive.displace(62.0, 68.0, 2.0);
  const auto scores = judge(drive.said, drive.truth, kFaults);
  CHECK(scores[0].largest_step_m < 0.5);
  CHECK(scores[1].largest_step_m == Approx(2.0).margin(0.4));
  CHECK(scores[1].largest_unannounced_m == scores[1].largest_step_m);
  CHECK(scores[1].ok_while_far_s == Approx(5.9).margin(0.11));
  CHECK(scores[1].poses - scores[1].within_3_sigma >= 60);
}

TEST_CASE("a step that is told by HEALTH or by a reset is not silent", "[reliability]") {
  Drive by_health(4);
  by_health.displace(62.0, 68.0, 2.0);
  for (SaidPose& pose : by_health.said) pose.is_ok = pose.utime < 61'000'000;
  const auto told = judge(by_health.said, by_health.truth, kFaults);
  CHECK(told[1].largest_step_m > 1.5);
  CHECK(told[1].largest_unannounced_m == 0.0);
  CHECK(told[1].ok_while_far_s == 0.0);

  Drive by_reset(4);
  by_reset.displace(62.0, 68.0, 2.0);
  for (SaidPose& pose : by_reset.said) pose.resets = pose.utime >= 61'300'000 ? 1 : 0;
  const auto reset = judge(by_reset.said, by_reset.truth, kFaults);
  CHECK(reset[1].is_announced);
  CHECK(reset[1].largest_unannounced_m < 0.5);
}

TEST_CASE("poses that end, and poses that are broken, are found", "[reliability]") {
  Drive drive(5);
  std::erase_if(drive.said, [](const SaidPose& pose) { return pose.utime > 61'500'000; });
  CHECK(judge(drive.said, drive.truth, kFaults)[0].goes_on);
  CHECK_FALSE(judge(drive.said, drive.truth, kFaults)[1].goes_on);

  drive.said[10].covariance(0, 0) = std::nan("");
  drive.said[20].covariance(1, 1) = -1.0;
  drive.said[30].utime = drive.said[29].utime;
  const Broken found = broken(drive.said);
  CHECK(found.not_finite == 1);
  CHECK(found.not_positive_definite == 1);
  CHECK(found.not_later == 1);
}

TEST_CASE("delays are apart, and of every kind", "[reliability]") {
  std::mt19937_64 random(6);
  DelayPlan plan;
  plan.processes = {"ekf", "associator"};
  const std::vector<Fault> faults = draw_delays(plan, 300, random);
  REQUIRE(faults.size() == 300);
  std::map<std::string, int> kinds;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    ++kinds[faults[i].what];
    CHECK(faults[i].to_s - faults[i].from_s <= plan.longest_s);
    if (i > 0) CHECK(faults[i].from_s - faults[i - 1].to_s == Approx(kApart_s));
  }
  CHECK(kinds.size() == 7);
  plan.only = "ekf";
  for (const Fault& fault : draw_delays(plan, 20, random)) CHECK(fault.what == "ekf stopped");
  plan.only = "nothing";
  CHECK_THROWS_AS(draw_delays(plan, 1, random), std::invalid_argument);
}

TEST_CASE("a launch that takes a while ends what it started, one that hangs is killed",
          "[reliability]") {
  const test::Scratch directory("reliability");
  const std::filesystem::path note = directory.path() / "pid";
  // As `launch` does: another group, which it ends some time after it is asked to.
  const std::string script =
      "trap 'sleep 0.3; kill $c; exit' TERM; setsid sleep 600 & c=$!; echo $c > " + note.string() +
      ".new; mv " + note.string() + ".new " + note.string() + "; wait";
  {
    Processes processes;
    processes.start({"sh", {"-c", script}, {}});
    while (!std::filesystem::exists(note))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  pid_t pid = 0;
  std::ifstream(note) >> pid;
  REQUIRE(pid > 0);
  const auto last = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  const auto runs = [&] { return ::kill(pid, 0) == 0 && !is_ended(pid); };
  while (runs() && std::chrono::steady_clock::now() < last)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  CHECK_FALSE(runs());
  if (runs()) ::kill(pid, SIGKILL);

  const auto begin = std::chrono::steady_clock::now();
  {
    Processes processes(std::chrono::milliseconds(200));
    processes.start({"sh", {"-c", "trap '' TERM; while :; do sleep 0.01; done"}, {}});
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(10));
}
