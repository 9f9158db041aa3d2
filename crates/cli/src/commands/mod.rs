//! Commands, one file per command.

pub mod check;
pub mod completions;
pub mod doctor;
pub mod figure;
pub mod fit;
pub mod infsup;
pub mod init;
pub mod man;
pub mod modes;
pub mod movie;
pub mod periodic;
pub mod response;
pub mod run;
pub mod scenes;
pub mod schema;
pub mod sensitivity;
pub mod sweep;
pub mod synchronization;
pub mod table1;
pub mod table2;
