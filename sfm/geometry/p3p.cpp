// Camera pose from three points: d_i y_i = R x_i + t with |y_i| = 1 and depths d_i > 0. The law of
// cosines gives three quadratic forms in d = (d1, d2, d3),
//
//   d^T M_ij d = a_ij,  M_ij: d_i^2 + d_j^2 - 2 (y_i . y_j) d_i d_j,  a_ij = |x_i - x_j|^2,
//
// and two homogeneous ones, conics in the projective plane of d:
//
//   D1 = a23 M12 - a12 M23,  D2 = a23 M13 - a13 M23,  d^T D1 d = d^T D2 d = 0.
//
// A member D1 + g D2 of their pencil with zero determinant (a cubic in g) is a pair of lines; each
// line meets the other conic in at most two points. The scale follows from the a_ij, the depths are
// polished by Newton's method.
//
// M. Persson, K. Nordberg, "Lambda Twist: An Accurate Fast Robust Perspective Three Point (P3P)
// Solver", ECCV 2018, section 3; the split into lines as in Y. Ding, J. Yang, V. Larsson, C.
// Olsson, K. Astrom, "Revisiting the P3P Problem", CVPR 2023, section 4, and J. Richter-Gebert,
// "Perspectives on Projective Geometry", 2011, section 11.1.
#include "sfm/geometry/p3p.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace trigmesh {

namespace {

using Points = std::array<Eigen::Vector3d, 3>;

/// The quadratic forms of the three sides 12, 13, 23.
struct Sides {
  std::array<Eigen::Matrix3d, 3> forms;
  std::array<double, 3> squares{};

  static Sides of(const Points& rays, const Points& points) {
    constexpr std::array<std::pair<std::size_t, std::size_t>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};
    Sides sides;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [i, j] = kPairs.at(k);
      const auto row = static_cast<Eigen::Index>(i);
      const auto col = static_cast<Eigen::Index>(j);
      Eigen::Matrix3d& form = sides.forms.at(k);
      form.setZero();
      form(row, row) = form(col, col) = 1.0;
      form(row, col) = form(col, row) = -rays.at(i).dot(rays.at(j));
      sides.squares.at(k) = (points.at(i) - points.at(j)).squaredNorm();
    }
    return sides;
  }
};

Eigen::Matrix3d adjugate(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d cofactors;
  cofactors.col(0) = m.col(1).cross(m.col(2));
  cofactors.col(1) = m.col(2).cross(m.col(0));
  cofactors.col(2) = m.col(0).cross(m.col(1));
  return cofactors.transpose();
}

/// The best separated real root of x^3 + a x^2 + b x + c.
double real_cubic_root(double a, double b, double c) {
  const double q = (a * a - 3.0 * b) / 9.0;
  const double r = (a * (2.0 * a * a - 9.0 * b) + 27.0 * c) / 54.0;
  double x = 0.0;
  if (r * r < q * q * q) {
    // Three real roots: the outer one on the side away from the double root.
    const double root_q = std::sqrt(q);
    const double angle = std::acos(std::abs(r) / (q * root_q)) / 3.0;
    x = std::copysign(2.0 * root_q * std::cos(angle), -r) - a / 3.0;
  } else {
    const double s = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(r * r - q * q * q)), r);
    x = s + (s == 0.0 ? 0.0 : q / s) - a / 3.0;
  }
  for (int i = 0; i < 2; ++i) {
    const double slope = (3.0 * x + 2.0 * a) * x + b;
    if (slope != 0.0) {
      x -= (((x + a) * x + b) * x + c) / slope;
    }
  }
  return x;
}

/// A degenerate member of the pencil and a conic that does not depend on it.
struct Pencil {
  Eigen::Matrix3d degenerate;
  Eigen::Matrix3d other;
};

Pencil degenerate_member(const Eigen::Matrix3d& d1, const Eigen::Matrix3d& d2) {
  const double c0 = d1.determinant();
  const double c1 = (adjugate(d1) * d2).trace();
  const double c2 = (adjugate(d2) * d1).trace();
  const double c3 = d2.determinant();
  constexpr double kZero = 1e-14;
  if (std::max(std::abs(c0), std::abs(c3)) <= kZero * std::max(std::abs(c1), std::abs(c2))) {
    return {d1, d2};  // symmetric configuration: d1 itself is degenerate
  }
  if (std::abs(c3) >= std::abs(c0)) {
    return {d1 + real_cubic_root(c2 / c3, c1 / c3, c0 / c3) * d2, d2};
  }
  return {d2 + real_cubic_root(c1 / c0, c2 / c0, c3 / c0) * d1, d1};
}

/// The two real lines of a degenerate conic; nothing when they are complex.
std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> split_into_lines(
    const Eigen::Matrix3d& conic) {
  const Eigen::Matrix3d crossing = -adjugate(conic);  // p p^T with p = l x m
  Eigen::Index k = 0;
  const double largest = crossing.diagonal().maxCoeff(&k);
  Eigen::Matrix3d product = conic;  // becomes 2 l m^T
  if (largest > 0.0) {
    const Eigen::Vector3d p = crossing.col(k) / std::sqrt(largest);
    Eigen::Matrix3d skew;
    skew << 0.0, -p.z(), p.y(), p.z(), 0.0, -p.x(), -p.y(), p.x(), 0.0;
    product += skew;
  } else if (crossing.diagonal().minCoeff() < -1e-10 * conic.squaredNorm()) {
    return std::nullopt;
  }
  Eigen::Index row = 0;
  Eigen::Index col = 0;
  product.cwiseAbs().maxCoeff(&row, &col);
  return std::pair(Eigen::Vector3d(product.col(col)), Eigen::Vector3d(product.row(row)));
}

/// Directions of positive depths where the line meets the conic: at most two.
struct Crossings {
  std::array<Eigen::Vector3d, 2> depths;
  std::size_t count = 0;
};

Crossings intersect(const Eigen::Vector3d& line, const Eigen::Matrix3d& conic) {
  Crossings out;
  Eigen::Index k = 0;
  line.cwiseAbs().maxCoeff(&k);
  const Eigen::Index i = (k + 1) % 3;
  const Eigen::Index j = (k + 2) % 3;
  Eigen::Vector3d u = Eigen::Vector3d::Unit(i);
  Eigen::Vector3d v = Eigen::Vector3d::Unit(j);
  u[k] = -line[i] / line[k];
  v[k] = -line[j] / line[k];
  // (u + tau v) on the conic: qa tau^2 + 2 qb tau + qc = 0
  const double qa = v.dot(conic * v);
  const double qb = u.dot(conic * v);
  const double qc = u.dot(conic * u);
  const double discriminant = qb * qb - qa * qc;
  if (discriminant < -1e-10 * (qb * qb + std::abs(qa * qc))) {
    return out;
  }
  const double q = -(qb + std::copysign(std::sqrt(std::max(0.0, discriminant)), qb));
  for (const double tau : {q / qa, qc / q}) {
    const Eigen::Vector3d depths = u + tau * v;
    if (depths.allFinite() && depths.minCoeff() > 0.0) {
      out.depths.at(out.count++) = depths;
    }
  }
  return out;
}

/// Gives depths their scale and polishes them on the three equations; false when they do not solve
/// them.
bool polish(const Sides& sides, Eigen::Vector3d& depths) {
  const double sum = sides.squares[0] + sides.squares[1] + sides.squares[2];
  const double form = depths.dot((sides.forms[0] + sides.forms[1] + sides.forms[2]) * depths);
  if (!(form > 0.0)) {
    return false;
  }
  depths *= std::sqrt(sum / form);
  constexpr int kSteps = 3;
  Eigen::Vector3d residual;
  for (int i = 0; i <= kSteps; ++i) {
    Eigen::Matrix3d jacobian;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d gradient = sides.forms.at(k) * depths;
      residual[static_cast<Eigen::Index>(k)] = gradient.dot(depths) - sides.squares.at(k);
      jacobian.row(static_cast<Eigen::Index>(k)) = 2.0 * gradient;
    }
    if (i == kSteps || residual.cwiseAbs().maxCoeff() < 1e-15 * sum) {
      break;
    }
    const Eigen::Vector3d delta = jacobian.inverse() * residual;
    if (!delta.allFinite()) {
      break;
    }
    depths -= delta;
  }
  constexpr double kAccepted = 1e-6;
  return depths.allFinite() && depths.minCoeff() > 0.0 &&
         residual.cwiseAbs().maxCoeff() < kAccepted * sum;
}

Eigen::Matrix3d frame_of(const Eigen::Vector3d& first,
                         const Eigen::Vector3d& second,
                         const Eigen::Vector3d& third) {
  Eigen::Matrix3d frame;
  frame.col(0) = second - first;
  frame.col(1) = third - first;
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

P3pSolutions solve_p3p(const std::array<Eigen::Vector3d, 3>& rays_in_cam,
                       const std::array<Eigen::Vector3d, 3>& points_in_world) {
  P3pSolutions solutions;
  const Eigen::Matrix3d world =
      frame_of(points_in_world[0], points_in_world[1], points_in_world[2]);
  constexpr double kCollinear = 1e-8;  // sine of the angle at the first point
  if (!(world.col(2).norm() > kCollinear * world.col(0).norm() * world.col(1).norm())) {
    return solutions;
  }
  const Eigen::Matrix3d world_inverse = world.inverse();
  const Sides sides = Sides::of(rays_in_cam, points_in_world);
  const double unit = 1.0 / (sides.squares[0] + sides.squares[1] + sides.squares[2]);
  const Eigen::Matrix3d d1 =
      unit * (sides.squares[2] * sides.forms[0] - sides.squares[0] * sides.forms[2]);
  const Eigen::Matrix3d d2 =
      unit * (sides.squares[2] * sides.forms[1] - sides.squares[1] * sides.forms[2]);
  const Pencil pencil = degenerate_member(d1, d2);
  const auto lines = split_into_lines(pencil.degenerate);
  if (!lines) {
    return solutions;
  }
  for (const Eigen::Vector3d& line : {lines->first, lines->second}) {
    Crossings crossings = intersect(line, pencil.other);
    for (std::size_t k = 0; k < crossings.count; ++k) {
      Eigen::Vector3d& depths = crossings.depths.at(k);
      if (!polish(sides, depths)) {
        continue;
      }
      const Eigen::Vector3d first = depths[0] * rays_in_cam[0];
      const Eigen::Matrix3d cam =
          frame_of(first, depths[1] * rays_in_cam[1], depths[2] * rays_in_cam[2]);
      const Eigen::Quaterniond rotation =
          Eigen::Quaterniond(Eigen::Matrix3d(cam * world_inverse)).normalized();
      solutions.cam_from_world.at(solutions.count++) = {rotation,
                                                        first - rotation * points_in_world[0]};
    }
  }
  return solutions;
}

}  // namespace trigmesh
