// The experiments of simulated drives, each added to `understory eval` by a function of its own.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <functional>
#include <string>
#include <type_traits>

#include "eval/harness/campaign.hpp"

namespace understory::eval::experiments {

/// --runs, --seed, --jobs, --json, --method, --no-plots.
void add_campaign_options(CLI::App& command, harness::CampaignOptions& options);
/// The same with the method "lidar", and --config for it.
void add_campaign_options_with_lidar(CLI::App& command, harness::CampaignOptions& options);

/// An option that takes a number from `least` to `most`; --help shows its default.
template <class T>
CLI::Option* add_number(CLI::App& command, const std::string& name, T& value,
                        std::type_identity_t<T> least, std::type_identity_t<T> most,
                        const std::string& text) {
  return command.add_option(name, value, text)
      ->check(CLI::Range(least, most))
      ->capture_default_str();
}

/// Runs `work` and turns what it throws into one line on stderr and exit status 1.
void run_guarded(const std::string& experiment, const std::function<void()>& work);

namespace accuracy {
/// Five paths and the double circle, intermediate forest (GeoSLAM §5.1).
void add_paths_experiment(CLI::App& eval);
/// Circles in three forests (GeoSLAM §5.2).
void add_density_experiment(CLI::App& eval);
/// Circles, five position noises times five detection rates, at two intervals (GeoSLAM §5.3).
void add_noise_experiment(CLI::App& eval);
}  // namespace accuracy

namespace efficiency {
/// Time per component along the run (GeoSLAM §5.5), over a long drive, and stationary.
void add_efficiency_experiment(CLI::App& eval);
}  // namespace efficiency

namespace backend {
/// Standard pose and landmark graphs through the smoother.
void add_backend_experiment(CLI::App& eval);
}  // namespace backend

namespace victoria_park {
/// The recorded Victoria Park drive.
void add_victoria_park_experiment(CLI::App& eval);
}  // namespace victoria_park

namespace frontend {
/// From raw sensors to a pose, part by part and as a whole.
void add_frontend_experiment(CLI::App& eval);
}  // namespace frontend

namespace recording {
/// A recorded drive through the whole chain.
void add_recording_experiment(CLI::App& eval);
}  // namespace recording

namespace roads {
/// Change of the error against the number of landmarks (thesis on submaps, chapter 4).
void add_landmarks_vs_error_experiment(CLI::App& eval);
}  // namespace roads

namespace misstated {
/// What becomes of drives whose sensors are not as told.
void add_misstated_experiment(CLI::App& eval);
}  // namespace misstated

namespace wheels {
/// The chain with wheels, with exact ones and without.
void add_wheels_experiment(CLI::App& eval);
}  // namespace wheels

namespace few_landmarks {
/// Live poses where two or three landmarks are in view.
void add_few_landmarks_experiment(CLI::App& eval);
}  // namespace few_landmarks

namespace closures {
/// Wrong loop closures that agree, and ways to keep them out.
void add_closures_experiment(CLI::App& eval);
}  // namespace closures

namespace mountings {
/// Wrong mountings, units and signs of sensors.
void add_mountings_experiment(CLI::App& eval);
}  // namespace mountings

namespace gaps {
/// Processes that hang and sensors that are silent.
void add_gaps_experiment(CLI::App& eval);
}  // namespace gaps

}  // namespace understory::eval::experiments
