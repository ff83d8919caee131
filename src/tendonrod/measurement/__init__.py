"""Measured trials: files, registration, accuracy against the model, identification, virtual experiments."""

from .accuracy import Accuracy, accuracy
from .bench import Experiment
from .columnmap import ColumnMap
from .crossvalidation import CrossValidation, cross_validate
from .csvfile import read_csv, write_csv
from .diagnosis import Diagnosis, diagnose
from .experiment import measured, run, simulate
from .identification import Fit, identify
from .loading import load_trials
from .ndifile import read_ndi
from .noise import Noise
from .prediction import Prediction, predict
from .profiles import Profile, profile
from .registration import Registration, base_registration, body_positions, registered, rigid_registration
from .setup import Setup
from .trial import Tracker, Trial
from .trialfile import read_trial, write_trial

__all__ = [
    "Accuracy",
    "ColumnMap",
    "CrossValidation",
    "Diagnosis",
    "Experiment",
    "Fit",
    "Noise",
    "Prediction",
    "Profile",
    "Registration",
    "Setup",
    "Tracker",
    "Trial",
    "accuracy",
    "base_registration",
    "body_positions",
    "cross_validate",
    "diagnose",
    "identify",
    "load_trials",
    "measured",
    "predict",
    "profile",
    "read_csv",
    "read_ndi",
    "read_trial",
    "registered",
    "rigid_registration",
    "run",
    "simulate",
    "write_csv",
    "write_trial",
]
