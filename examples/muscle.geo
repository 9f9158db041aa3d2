// A muscle of 20 cm between two tendons, m. `gmsh -3 muscle.geo` writes muscle.msh (Gmsh 4.8.4).
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 0.12};
Dilate{{0, 0, 0}, {1, 0.2, 0.15}}{ Volume{1}; }
Box(2) = {-0.1, -0.1, -0.1, 0.2, 0.2, 0.2};
BooleanIntersection(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
left() = Surface In BoundingBox{-0.101, -0.1, -0.1, -0.099, 0.1, 0.1};
right() = Surface In BoundingBox{0.099, -0.1, -0.1, 0.101, 0.1, 0.1};
Physical Surface("left") = {left()};
Physical Surface("right") = {right()};
Physical Volume("muscle") = {3};
Mesh.MeshSizeMax = 0.02;
Mesh.MeshSizeMin = 0.014;
Mesh.ElementOrder = 2;
Mesh.HighOrderOptimize = 2;
