// The gyro's bias as variables of the mapper's graph.
#pragma once

#include <optional>
#include <vector>

#include "common/factor_graph/plane/smoother.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/smoothing/centre_motion.hpp"
#include "services/geoslam_mapper/smoothing/free_numbers.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A chain of scalars, one per 5 s, each tied to the previous one by the bias's random walk. They
/// count from odometry's own bias at the first motion, so they are small. Scalars without motions
/// in the graph are removed.
class GyroBias {
 public:
  /// `walk`: random walk of the bias [rad/s/sqrt(s)]; 0 = the bias is not estimated.
  /// `start_sigma`: of odometry's bias at the first motion, before any stop [rad/s].
  GyroBias(double walk, double start_sigma) : walk_(walk), start_sigma_(start_sigma) {}

  /// Whether the bias is a variable of the graph.
  bool is_estimated() const { return walk_ > 0.0; }

  /// The motion between two poses with the bias as a third variable, for the graph. `measured`
  /// holds the two poses; its motion and information are those of `motion`, which must have `gyro`.
  /// The bias measured at the stops before the motion enters the graph, too; the filter's bias is
  /// not used since it was estimated from the same detections.
  factor_graph::plane::BiasedRelativePose biased(factor_graph::plane::RelativePose measured,
                                                 const CentreMotion& motion,
                                                 factor_graph::plane::Smoother& smoother);

  /// The present bias; none before the first motion.
  struct Estimate {
    double mean = 0.0;      ///< In the scalars' reference [rad/s].
    double variance = 0.0;  ///< [(rad/s)^2]
  };
  /// Marginal of the newest scalar.
  std::optional<Estimate> estimate(const factor_graph::plane::Smoother& smoother) const;
  /// A motion with this scalar was removed from the graph.
  void forget_motion(factor_graph::plane::ScalarId id);
  /// Keeps the information of removed motions on a scalar [rad/s, 1/(rad/s)^2] as a prior; does
  /// nothing if the scalar is not one of the newest.
  void learned(factor_graph::plane::ScalarId id, double mean, double information,
               factor_graph::plane::Smoother& smoother);
  /// Removes scalars without motion, except the newest; their information moves to the next ones.
  void drop_idle(factor_graph::plane::Smoother& smoother);
  /// After motions were removed: removes scalars without motion, and keeps the previous estimate,
  /// `before`, as a prior of the newest scalar. That counts the information of the remaining
  /// motions twice; the prior is weakened for it.
  void keep(const Estimate& before, factor_graph::plane::Smoother& smoother);

  /// Checkpoint, as of the graph.
  void checkpoint();
  /// Rollback, as of the graph.
  void rollback();

  /// Members of a saved state; see common/state. The walk is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.now_, self.free_scalars_, self.free_priors_, self.free_steps_);
  }

 private:
  /// One scalar of the chain.
  struct Link {
    factor_graph::plane::ScalarId id{};
    model::Utime since = 0;
    std::uint32_t motions = 0;                                ///< Number of motions with it.
    std::optional<factor_graph::plane::ScalarPriorId> prior;  ///< The scalar's own prior.
    std::optional<factor_graph::plane::ScalarStepId> step;    ///< From the link before.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.since, s.motions, s.prior, s.step);
    }
  };
  struct State {
    double reference = 0.0;   ///< Zero of the scalars [rad/s].
    std::vector<Link> chain;  ///< The newest ones; older ones stay in the graph as they are.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.reference, s.chain);
    }
  };

  void go_on(const CentreMotion& motion, factor_graph::plane::Smoother& smoother);
  void add_link(double initial, model::Utime utime, factor_graph::plane::Smoother& smoother);
  void set_prior(Link& link, double mean, double information,
                 factor_graph::plane::Smoother& smoother);
  void add_prior(Link& link, double mean, double information,
                 factor_graph::plane::Smoother& smoother);
  void set_step(Link& link, factor_graph::plane::ScalarId from, double information,
                factor_graph::plane::Smoother& smoother);
  void take_out(std::size_t at, factor_graph::plane::Smoother& smoother);
  void clear(Link& link, factor_graph::plane::Smoother& smoother);

  double walk_;         ///< [rad/s/sqrt(s)]
  double start_sigma_;  ///< [rad/s]
  State now_;
  State saved_;  ///< State at the checkpoint.
  FreeNumbers free_scalars_;
  FreeNumbers free_priors_;
  FreeNumbers free_steps_;
};

}  // namespace understory::geoslam_mapper::smoothing
