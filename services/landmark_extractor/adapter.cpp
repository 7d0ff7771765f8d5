#include "services/landmark_extractor/adapter.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "services/landmark_extractor/adapter_parameters.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "services/landmark_extractor/place/place_scans.hpp"

namespace understory::landmark_extractor {
namespace {

constexpr model::Utime kSummaryPeriod_us = 10000000;

/// "trunks 12 (too_few_points 3, ...), corners ..."; empty without a sweep.
std::string summary(const SweepCounters& now, const SweepCounters& before) {
  if (now.sweeps == before.sweeps) return "";
  std::string text;
  const auto add = [&](std::string_view name, std::uint64_t count) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, count);
  };
  const trunks::TrunkCounters& t = now.trunks;
  const trunks::TrunkCounters& t0 = before.trunks;
  const corners::CornerCounters& c = now.corners;
  const corners::CornerCounters& c0 = before.corners;

  add("sweeps", now.sweeps - before.sweeps);
  add("trunks", t.trunks - t0.trunks);
  add("columns of returns left out: too few points", t.too_few_points - t0.too_few_points);
  add("no fit", t.no_fit - t0.no_fit);
  add("wrong radius", t.wrong_radius - t0.wrong_radius);
  add("leaning", t.leaning - t0.leaning);
  add("not round", t.not_round - t0.not_round);
  add("uncertain", t.uncertain - t0.uncertain);
  add("not standing", t.not_standing - t0.not_standing);
  add("in leaves", t.in_leaves - t0.in_leaves);
  add("out of range", t.out_of_range - t0.out_of_range);
  add("on a wall", now.on_wall - before.on_wall);

  add("corners", c.corners - c0.corners);
  add("walls", c.walls - c0.walls);
  add("pairs of walls left out: skew", c.skew - c0.skew);
  add("low", c.low - c0.low);
  add("hidden", c.hidden - c0.hidden);
  return text;
}

class LandmarkExtractorAdapter : public bus::Adapter {
 public:
  explicit LandmarkExtractorAdapter(LandmarkExtractorChannels channels)
      : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    landmark_extractor::describe(parameters_, table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    stage_.emplace(parameters_);
    place_scans_.emplace(parameters_.place_scan);
    node.subscribe<model::PlanarScan>(channels_.lidar_scan,
                                      [this](const model::PlanarScan& scan) { add_scan(scan); },
                                      {.queue_size = 200});
    // Each sweep is processed independently: there is no state but counters, which restart with the
    // process. A sweep received in part before a restart is lost, and counted when its next part
    // arrives.
    node.subscribe<model::PointSweep>(channels_.lidar_sweep,
                                      [this](const model::PointSweep& part) { add_part(part); },
                                      {.queue_size = 1000, .journaled = false});
    landmarks_ = node.advertise<model::LandmarkScan>(channels_.landmarks);
    view_ranges_ = node.advertise<model::ViewRanges>(channels_.view_ranges);
    place_clouds_ = node.advertise<model::PlaceScan>(channels_.place_scan);
    node.every(kSummaryPeriod_us, [this](model::Utime /*now*/) { log_summary(); });
  }

 private:
  void add_scan(const model::PlanarScan& scan) {
    const std::uint64_t malformed = stage_->counters().scans_malformed;
    const model::LandmarkScan landmarks = stage_->extract(scan);
    if (stage_->counters().scans_malformed == malformed) publish_place(scan);
    publish(landmarks);
  }

  void add_part(const model::PointSweep& part) {
    const auto sweep = assembler_.add(part);
    if (assembler_.incomplete_revolutions() > incomplete_) {
      incomplete_ = assembler_.incomplete_revolutions();
      node_->report(wire::Reason::kPartsMissing, "a sweep of which parts are missing is left out",
                    channels_.lidar_sweep);
    }
    if (!sweep) return;
    const SweepCounters before = stage_->sweep_counters();
    const model::LandmarkScan landmarks = stage_->extract(*sweep);
    report_faults(before, stage_->sweep_counters());
    if (stage_->sweep_counters().malformed > before.malformed) return;
    publish_place(*sweep);
    publish(landmarks);
  }

  /// Publish before LANDMARKS: their consumers look up this cloud.
  template <class Sweep>
  void publish_place(const Sweep& sweep) {
    if (const auto scan = place_scans_->add(sweep)) place_clouds_.publish(*scan);
  }

  /// Publish ranges before LANDMARKS: their consumers look up the ranges.
  void publish(const model::LandmarkScan& landmarks) {
    if (!stage_->view().free.empty()) view_ranges_.publish(stage_->view());
    landmarks_.publish(landmarks);
  }

  void report_faults(const SweepCounters& before, const SweepCounters& now) {
    const auto report = [&](wire::Reason reason, std::string_view text) {
      node_->report(reason, text, channels_.lidar_sweep);
    };
    if (now.malformed > before.malformed) {
      report(wire::Reason::kInconsistent,
             "a sweep without rings or not in frame vehicle is left out");
    }
    if (now.without_attitude > before.without_attitude) {
      report(wire::Reason::kNotCalibrated, "a sweep without attitude is taken as level");
    }
    if (now.points.not_finite > before.points.not_finite) {
      report(wire::Reason::kNotFinite, "points that are not finite are left out");
    }
    if (now.points.bad_ring > before.points.bad_ring) {
      report(wire::Reason::kOutOfRange,
             "points of rings that the sensor does not have are left out");
    }
  }

  /// Counts of objects since the last time, with reasons.
  void log_summary() {
    const std::string all = summary(stage_->sweep_counters(), reported_);
    if (!all.empty()) node_->log(bus::Node::Level::kInfo, "landmarks", all, channels_.lidar_sweep);
    reported_ = stage_->sweep_counters();
  }

  LandmarkExtractorChannels channels_;
  LandmarkExtractorParameters parameters_;
  bus::Node* node_ = nullptr;
  std::optional<LandmarkExtractor> stage_;
  std::optional<place::PlaceScans> place_scans_;
  model::SweepAssembler assembler_;
  std::uint64_t incomplete_ = 0;
  SweepCounters reported_;
  bus::Publisher<model::LandmarkScan> landmarks_;
  bus::Publisher<model::ViewRanges> view_ranges_;
  bus::Publisher<model::PlaceScan> place_clouds_;
};

}  // namespace

bus::Service landmark_extractor_service(const LandmarkExtractorChannels& channels) {
  return {"landmark_extractor", channels.all,
          [channels] { return std::make_unique<LandmarkExtractorAdapter>(channels); }};
}

}  // namespace understory::landmark_extractor
