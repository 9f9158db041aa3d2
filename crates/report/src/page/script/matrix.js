// Rotations of the body as 3 by 3 matrices in rows.

const multiply = (a, b) => a.map((row) => [0, 1, 2].map((j) => row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]));

/** Returns a rotation about the axis `k` by an angle. */
function rotation(k, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const [i, j] = [(k + 1) % 3, (k + 2) % 3];
  const matrix = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  matrix[k][k] = 1;
  matrix[i][i] = matrix[j][j] = c;
  matrix[i][j] = -s;
  matrix[j][i] = s;
  return matrix;
}

/** Views by name: the rows are the directions to the right, upward and to the reader. */
const VIEWS = {
  "x–y": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  "x–z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
  "y–z": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
  oblique: multiply(rotation(0, 0.45), multiply(rotation(1, -0.6), [[1, 0, 0], [0, 0, 1], [0, -1, 0]])),
};
