// Essential matrix from five matches. The five constraints x2^T E x1 = 0 leave E = x E1 + y E2 + z
// E3 + E4. Then
//
//   det E = 0,   2 E E^T E - tr(E E^T) E = 0
//
// are ten cubics in (x, y, z). Solving them for the ten monomials of degree three gives
// multiplication by x as a 10x10 matrix on the ten monomials of lower degree; its eigenvectors hold
// (x, y, z).
//
// H. Stewenius, C. Engels, D. Nister, "Recent developments on direct relative orientation", ISPRS
// Journal 2006, section 3; D. Nister, "An efficient solution to the five-point relative pose
// problem", PAMI 2004, equations 5 to 7.
#include "sfm/geometry/five_point.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace trigmesh {

namespace {

// Monomials x^a y^b z^c by falling degree. Polynomials of degree two start at kQuadratic of this
// list, of degree one at kLinear, and are stored without the zeros before.
struct Exponents {
  int x, y, z;

  constexpr bool operator==(const Exponents&) const = default;
};

constexpr std::array<Exponents, 20> kMonomials{
    {{3, 0, 0}, {2, 1, 0}, {2, 0, 1}, {1, 2, 0}, {1, 1, 1}, {1, 0, 2}, {0, 3, 0},
     {0, 2, 1}, {0, 1, 2}, {0, 0, 3}, {2, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 2, 0},
     {0, 1, 1}, {0, 0, 2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
constexpr std::size_t kQuadratic = 10;
constexpr std::size_t kLinear = 16;

using Linear = Eigen::Matrix<double, 4, 1>;
using Quadratic = Eigen::Matrix<double, 10, 1>;
using Cubic = Eigen::Matrix<double, 20, 1>;

constexpr std::size_t position(const Exponents& wanted) {
  std::size_t i = 0;
  while (!(kMonomials.at(i) == wanted)) {
    ++i;
  }
  return i;
}

/// table[i][j]: where the product of monomial first + i and monomial kLinear + j stands, counted
/// from `origin`.
template <std::size_t kRows>
constexpr std::array<std::array<Eigen::Index, 4>, kRows> product_table(std::size_t first,
                                                                       std::size_t origin) {
  std::array<std::array<Eigen::Index, 4>, kRows> table{};
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      const Exponents a = kMonomials.at(first + i);
      const Exponents b = kMonomials.at(kLinear + j);
      table.at(i).at(j) =
          static_cast<Eigen::Index>(position({a.x + b.x, a.y + b.y, a.z + b.z}) - origin);
    }
  }
  return table;
}

constexpr auto kLinearTimesLinear = product_table<4>(kLinear, kQuadratic);
constexpr auto kQuadraticTimesLinear = product_table<10>(kQuadratic, 0);

void add_product(const Linear& a, const Linear& b, Quadratic& sum) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      sum[kLinearTimesLinear[i][j]] +=
          a[static_cast<Eigen::Index>(i)] * b[static_cast<Eigen::Index>(j)];
    }
  }
}

void add_product(const Quadratic& a, const Linear& b, Cubic& sum) {
  for (std::size_t i = 0; i < 10; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      sum[kQuadraticTimesLinear[i][j]] +=
          a[static_cast<Eigen::Index>(i)] * b[static_cast<Eigen::Index>(j)];
    }
  }
}

/// E as a 3x3 matrix of linear polynomials, row by row.
using LinearMatrix = std::array<std::array<Linear, 3>, 3>;
using Constraints = Eigen::Matrix<double, 10, 20>;

/// Orthonormal basis of the matrices that satisfy the five linear constraints: 9x4, entries row by
/// row.
Eigen::Matrix<double, 9, 4> null_space(const std::array<Eigen::Vector3d, 5>& rays_in_first,
                                       const std::array<Eigen::Vector3d, 5>& rays_in_second) {
  Eigen::Matrix<double, 9, 5> rows;
  for (std::size_t i = 0; i < 5; ++i) {
    const Eigen::Vector3d& x1 = rays_in_first.at(i);
    const Eigen::Vector3d& x2 = rays_in_second.at(i);
    rows.col(static_cast<Eigen::Index>(i)) << x2.x() * x1, x2.y() * x1, x2.z() * x1;
  }
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 5>> qr(rows);
  const Eigen::Matrix<double, 9, 9> q = qr.householderQ();
  return q.rightCols<4>();
}

Quadratic minor_of(const LinearMatrix& e, std::size_t c1, std::size_t c2) {
  Quadratic out = Quadratic::Zero();
  add_product(e[0][c1], e[1][c2], out);
  add_product(-e[0][c2], e[1][c1], out);
  return out;
}

Constraints constraints_of(const LinearMatrix& e) {
  std::array<std::array<Quadratic, 3>, 3> product;  // E E^T - tr(E E^T) / 2
  Quadratic half_trace = Quadratic::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      product[i][j].setZero();
      for (std::size_t k = 0; k < 3; ++k) {
        add_product(e[i][k], e[j][k], product[i][j]);
      }
      product[j][i] = product[i][j];
    }
    half_trace += 0.5 * product[i][i];
  }
  Constraints constraints;
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    product[i][i] -= half_trace;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      Cubic cubic = Cubic::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        add_product(product[i][k], e[k][j], cubic);
      }
      constraints.row(row++) = cubic;
    }
  }
  Cubic determinant = Cubic::Zero();
  add_product(minor_of(e, 1, 2), e[2][0], determinant);
  add_product(minor_of(e, 2, 0), e[2][1], determinant);
  add_product(minor_of(e, 0, 1), e[2][2], determinant);
  constraints.row(row) = determinant;
  return constraints;
}

}  // namespace

FivePointSolutions solve_five_point(const std::array<Eigen::Vector3d, 5>& rays_in_first,
                                    const std::array<Eigen::Vector3d, 5>& rays_in_second) {
  FivePointSolutions out;
  const Eigen::Matrix<double, 9, 4> basis = null_space(rays_in_first, rays_in_second);
  LinearMatrix e;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      e[i][j] = basis.row(static_cast<Eigen::Index>(3 * i + j));
    }
  }
  using Matrix10 = Eigen::Matrix<double, 10, 10>;
  const Constraints constraints = constraints_of(e);
  const Matrix10 reduced =
      constraints.leftCols<10>().partialPivLu().solve(constraints.rightCols<10>());
  if (!reduced.allFinite()) {
    return out;
  }
  // Multiplication by x maps x^2, xy, xz, y^2, yz, z^2 to the first six cubic monomials and x, y,
  // z, 1 to the monomials x^2, xy, xz, x.
  Matrix10 action = Matrix10::Zero();
  action.topRows<6>() = -reduced.topRows<6>();
  action(6, 0) = action(7, 1) = action(8, 2) = action(9, 6) = 1.0;
  const Eigen::EigenSolver<Matrix10> solver(action);
  if (solver.info() != Eigen::Success) {
    return out;
  }
  for (Eigen::Index k = 0; k < 10; ++k) {
    if (solver.eigenvalues()[k].imag() != 0.0) {
      continue;
    }
    const Eigen::Matrix<double, 4, 1> xyz1 = solver.pseudoEigenvectors().col(k).tail<4>();
    const Eigen::Matrix<double, 9, 1> entries = (basis * xyz1).normalized();
    if (!entries.allFinite()) {
      continue;
    }
    out.essentials.at(out.count++) << entries.segment<3>(0).transpose(),
        entries.segment<3>(3).transpose(), entries.segment<3>(6).transpose();
  }
  return out;
}

}  // namespace trigmesh
