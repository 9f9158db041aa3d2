// An eye: a thin shell around a ball with a hollow for the lens, held behind; lengths in m. `gmsh -3 eye.geo` writes eye.msh (Gmsh 4.8.4).
SetFactory("OpenCASCADE");
Mesh.MeshSizeMax = 0.006;
Mesh.MeshSizeMin = 0.005;
Mesh.MeshSizeFromCurvature = 3;
Mesh.ElementOrder = 1;
Sphere(1) = {0, 0, 0, 0.012};
Sphere(2) = {0, 0, 0, 0.0108};
Sphere(3) = {0.0095, 0, 0, 0.005};
Box(4) = {-0.02, -0.02, -0.02, 0.01, 0.04, 0.04};
BooleanDifference(5) = { Volume{1}; Delete; }{ Volume{2}; };
BooleanDifference(6) = { Volume{5}; Delete; }{ Volume{4}; };
BooleanDifference(7) = { Volume{2}; Delete; }{ Volume{3, 4}; Delete; };
BooleanFragments{ Volume{6}; Delete; }{ Volume{7}; Delete; }
parts() = Volume In BoundingBox{-1, -1, -1, 1, 1, 1};
held() = Surface In BoundingBox{-0.0101, -0.2, -0.2, -0.0099, 0.2, 0.2};
Physical Volume("tissue") = {parts()};
Physical Surface("held") = {held()};
free() = CombinedBoundary{ Volume{parts()}; };
free() -= held();
Physical Surface("free") = {free()};
