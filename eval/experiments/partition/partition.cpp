#include "eval/experiments/partition/partition.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/submap_shelf.hpp"
#include "eval/tools/memory.hpp"
#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::eval::experiments::partition {
namespace {

geoslam_mapper::SmoothingMapperParameters mapper_parameters(const Keeping& keeping) {
  geoslam_mapper::SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  parameters.gyro_walk = 0.0;
  parameters.start_wait_s = 0.0;
  parameters.condense_m = keeping.size_m;
  parameters.hand_over_m = keeping.hand_over_m;
  parameters.condense_of_range = 1000.0;
  return parameters;
}

Section section_of(double end_m, const std::vector<double>& ms, std::ptrdiff_t mapper_bytes) {
  Section section;
  section.end_m = end_m;
  section.ms_p50 = tools::quantile(ms, 0.5);
  section.ms_p99 = tools::quantile(ms, 0.99);
  section.ms_max = tools::quantile(ms, 1.0);
  section.resident_mb = tools::resident_mb();
  section.mapper_mb = 1e-6 * static_cast<double>(mapper_bytes);
  return section;
}

}  // namespace

DriveResult drive(const RouteParameters& parameters, std::uint64_t seed, const Keeping& keeping,
                  std::size_t sections) {
  Route route(parameters, seed);
  harness::SubmapShelf shelf;
  DriveResult result;
  std::vector<double> ms;
  double nees = 0.0;
  std::size_t told = 0;
  const std::size_t per_section = std::max<std::size_t>(1, route.size() / sections);
  ms.reserve(route.size());

  const std::ptrdiff_t before = tools::heap_in_use();
  const auto mapper =
      std::make_unique<geoslam_mapper::smoothing::SmoothingMapper>(mapper_parameters(keeping));
  std::ptrdiff_t mapper_bytes = tools::heap_in_use() - before;

  for (std::size_t k = 0; k < route.size(); ++k) {
    terminal::throw_if_interrupted();
    const std::optional<model::Odometry> odometry =
        k > 0 ? std::optional(route.odometry(k)) : std::nullopt;
    const model::Keyframe keyframe = route.keyframe(k);
    const geometry::SE2 truth = route.pose(k);

    // What the heap grows by from here to the end of the scope is the mapper's.
    const std::ptrdiff_t before_keyframe = tools::heap_in_use();
    {
      if (odometry) mapper->add(*odometry);
      const double begin_s = tools::thread_time_s();
      const model::MapUpdate update = mapper->add(keyframe);
      shelf.serve(*mapper);
      ms.push_back(1e3 * (tools::thread_time_s() - begin_s));
      (void)mapper->take_changed_landmarks();
      if (!update.merged.empty()) result.closure_ms = std::max(result.closure_ms, ms.back());

      if (update.status == model::MapUpdateStatus::kUpdated) {
        const Eigen::Vector3d error = (update.map_T_vehicle.inverse() * truth).Log();
        nees += error.dot(update.covariance.inverse() * error);
        ++told;
      } else if (k > 0) {
        ++result.refused;
      }
    }
    mapper_bytes += tools::heap_in_use() - before_keyframe;

    if ((k + 1) % per_section == 0) {
      result.sections.push_back(section_of(Route::along_m(k), ms, mapper_bytes));
      ms.clear();
    }
  }

  std::vector<model::KeyframePose> keyframes = mapper->trajectory();
  std::ranges::copy(shelf.keyframes(*mapper), std::back_inserter(keyframes));
  std::ranges::sort(keyframes, {}, &model::KeyframePose::utime);
  std::vector<geometry::SE2> truth;
  for (const model::KeyframePose& pose : keyframes) {
    result.trajectory.push_back(pose.map_T_vehicle);
    truth.push_back(route.pose(Route::number_of(pose.utime)));
  }
  result.rmse_to_truth_m = rmse_m(result.trajectory, truth);
  result.landmarks = mapper->landmarks().size() + shelf.landmarks();
  result.disk_bytes = shelf.bytes();
  result.brought_back = shelf.brought_back();
  if (told > 0) result.mean_nees = nees / static_cast<double>(told);
  return result;
}

double rmse_m(const std::vector<geometry::SE2>& a, const std::vector<geometry::SE2>& b) {
  const std::size_t count = std::min(a.size(), b.size());
  double squared = 0.0;
  for (std::size_t i = 0; i < count; ++i)
    squared += (a[i].translation() - b[i].translation()).squaredNorm();
  return count > 0 ? std::sqrt(squared / static_cast<double>(count)) : 0.0;
}

}  // namespace understory::eval::experiments::partition
