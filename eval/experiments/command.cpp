#include "eval/experiments/command.hpp"

#include "eval/experiments/changing_forest/changing_forest.hpp"
#include "eval/experiments/changing_forest/mapping_needed.hpp"
#include "eval/experiments/existence/camera/existence_camera.hpp"
#include "eval/experiments/existence/census/existence_census.hpp"
#include "eval/experiments/existence/existence.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/health/health.hpp"
#include "eval/experiments/laps/laps.hpp"
#include "eval/experiments/large_map/large_map.hpp"
#include "eval/experiments/loop_detectors/loop_detectors.hpp"
#include "eval/experiments/loops/loops_command.hpp"
#include "eval/experiments/merges/merges.hpp"
#include "eval/experiments/one_shot/one_shot.hpp"
#include "eval/experiments/partition/partition.hpp"
#include "eval/experiments/place_recognition/place_recognition.hpp"
#include "eval/experiments/reliability/reliability.hpp"
#include "eval/experiments/returns/returns.hpp"
#include "eval/experiments/shared_errors/shared_errors.hpp"

namespace understory::eval::experiments {

void add_experiments(CLI::App& eval) {
  eval.require_subcommand(1);
  accuracy::add_paths_experiment(eval);
  accuracy::add_density_experiment(eval);
  accuracy::add_noise_experiment(eval);
  efficiency::add_efficiency_experiment(eval);
  large_map::add_large_map_experiment(eval);
  one_shot::add_one_shot_experiment(eval);
  merges::add_map_merge_experiment(eval);
  backend::add_backend_experiment(eval);
  victoria_park::add_victoria_park_experiment(eval);
  frontend::add_frontend_experiment(eval);
  recording::add_recording_experiment(eval);
  laps::add_laps_experiment(eval);
  returns::add_returns_experiment(eval);
  loops::add_loops_experiment(eval);
  shared_errors::add_shared_errors_experiment(eval);
  place_recognition::add_place_recognition_experiment(eval);
  loop_detectors::add_loop_detectors_experiment(eval);
  health::add_health_experiment(eval);
  roads::add_landmarks_vs_error_experiment(eval);
  misstated::add_misstated_experiment(eval);
  wheels::add_wheels_experiment(eval);
  gaps::add_gaps_experiment(eval);
  mountings::add_mountings_experiment(eval);
  reliability::add_reliability_experiment(eval);
  few_landmarks::add_few_landmarks_experiment(eval);
  closures::add_closures_experiment(eval);
  existence::add_existence_experiment(eval);
  changing_forest::add_changing_forest_experiment(eval);
  changing_forest::add_mapping_needed_experiment(eval);
  existence::camera::add_existence_camera_experiment(eval);
  existence::census::add_existence_census_experiment(eval);
  partition::add_partition_experiments(eval);
  partition::add_long_drive_experiments(eval);
}

}  // namespace understory::eval::experiments
